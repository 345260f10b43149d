#include "data/merge/session_copy.h"

#include <SQLiteCpp/Statement.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

namespace palpate::data {
namespace {

/// "number, observer_sha256": the columns of a table without keys.
std::string columns_but_keys(SQLite::Database& db, const std::string& table) {
  std::string columns;
  SQLite::Statement find(db, "SELECT name FROM pragma_table_info(?)");
  find.bind(1, table);
  while (find.executeStep()) {
    const std::string name = find.getColumn(0).getString();
    if (name == "id" || name.ends_with("_id")) continue;
    columns += (columns.empty() ? "" : ", ") + name;
  }
  return columns;
}

bool same_value(const SQLite::Column& a, const SQLite::Column& b) {
  if (a.getType() != b.getType()) return false;
  if (a.isInteger()) return a.getInt64() == b.getInt64();
  if (a.isFloat()) return a.getDouble() == b.getDouble();
  const void *bytes_a = a.getBlob(), *bytes_b = b.getBlob();  // must precede getBytes()
  const int size = a.getBytes();
  return size == b.getBytes() &&
         (size == 0 || std::memcmp(bytes_a, bytes_b, static_cast<std::size_t>(size)) == 0);
}

void bind_value(SQLite::Statement& to, int index, const SQLite::Column& value) {
  if (value.isInteger()) {
    to.bind(index, value.getInt64());
  } else if (value.isFloat()) {
    to.bind(index, value.getDouble());
  } else if (value.isText()) {
    to.bind(index, value.getString());
  } else if (value.isBlob()) {
    const void* const bytes = value.getBlob();
    to.bindNoCopy(index, bytes, value.getBytes());
  } else {
    to.bind(index);
  }
}

bool same_rows(SQLite::Statement& a, SQLite::Statement& b) {
  if (a.getColumnCount() != b.getColumnCount()) return false;
  while (true) {
    const bool more = a.executeStep();
    if (more != b.executeStep()) return false;
    if (!more) return true;
    for (int i = 0; i < a.getColumnCount(); ++i) {
      if (!same_value(a.getColumn(i), b.getColumn(i))) return false;
    }
  }
}

/// Inserts rows whose first columns are keys.
class Inserter {
 public:
  Inserter(SQLite::Database& db, const std::string& table, int keys, const std::string& key_names,
           const std::string& columns, int count)
      : db_(db),
        keys_(keys),
        insert_(db, "INSERT INTO " + table + " (" + key_names + ", " + columns + ") VALUES (?" +
                        repeated(keys + count - 1) + ")") {}
  /// \return the new row's id
  std::int64_t operator()(const std::vector<std::int64_t>& keys, SQLite::Statement& row) {
    insert_.reset();
    for (int i = 0; i < keys_; ++i) insert_.bind(i + 1, keys[static_cast<std::size_t>(i)]);
    for (int i = kParentColumns; i < row.getColumnCount(); ++i) {
      bind_value(insert_, keys_ + i - kParentColumns + 1, row.getColumn(i));
    }
    insert_.exec();
    return db_.getLastInsertRowid();
  }

 private:
  static std::string repeated(int times) {
    std::string text;
    for (int i = 0; i < times; ++i) text += ", ?";
    return text;
  }
  SQLite::Database& db_;
  int keys_;
  SQLite::Statement insert_;
};

/// Copies one session from database to database, table by table, and maps the keys.
class SessionCopier {
 public:
  SessionCopier(SQLite::Database& from, std::int64_t id, SQLite::Database& to)
      : from_(from), id_(id), to_(to), rows_(session_rows(from)) {}

  void copy(std::int64_t participant) {
    copy_session_row(participant);
    copy_runs();
    copy_notes();
    copy_attempts();
    copy_samples();
    copy_page_answers();
  }

 private:
  template <class Visit>
  void each_row(const std::string& sql, const Visit& visit) {
    SQLite::Statement row(from_, sql);
    row.bind(1, id_);
    while (row.executeStep()) visit(row);
  }
  Inserter inserter(const std::string& table, int keys, const std::string& key_names,
                    const std::string& columns) {
    const auto commas = std::count(columns.begin(), columns.end(), ',');
    return {to_, table, keys, key_names, columns, static_cast<int>(commas) + 1};
  }
  /// The new id of the run that a row belongs to.
  std::int64_t run_of(SQLite::Statement& row) const {
    const std::int64_t position = row.getColumn(0).getInt64();
    if (position < 1 || position > static_cast<std::int64_t>(runs_.size())) {
      throw SQLite::Exception("an attempt is of a run of another session", SQLITE_CORRUPT);
    }
    return runs_[static_cast<std::size_t>(position - 1)];
  }
  void copy_session_row(std::int64_t participant) {
    const std::string columns = columns_but_keys(from_, "sessions");
    Inserter add = inserter("sessions", 1, "participant_id", columns);
    each_row("SELECT 0, 0, " + columns + " FROM sessions WHERE id = ?1",
             [&](auto& row) { session_ = add({participant}, row); });
  }
  void copy_runs() {
    Inserter add = inserter("runs", 1, "session_id", rows_[0].columns);
    SQLite::Statement shown_with(to_,
                                 "UPDATE runs SET protocol_id = (SELECT id FROM protocols WHERE "
                                 "sha256 = ?) WHERE id = ?");
    each_row(rows_[0].select, [&](auto& row) {
      runs_.push_back(add({session_}, row));
      if (row.getColumn(1).isNull()) return;
      shown_with.reset();
      shown_with.bind(1, row.getColumn(1).getString());
      shown_with.bind(2, runs_.back());
      shown_with.exec();
    });
  }
  void copy_notes() {
    Inserter add = inserter("notes", 1, "run_id", rows_[1].columns);
    each_row(rows_[1].select, [&](auto& row) { add({run_of(row)}, row); });
  }
  void copy_attempts() {
    Inserter add = inserter("attempts", 2, "session_id, run_id", rows_[2].columns);
    each_row(rows_[2].select, [&](auto& row) {
      attempts_[{row.getColumn("trial").getInt64(), row.getColumn("attempt").getInt64()}] =
          add({session_, run_of(row)}, row);
    });
  }
  void copy_samples() {
    Inserter add = inserter("samples", 1, "attempt_id", rows_[3].columns);
    each_row(rows_[3].select, [&](auto& row) {
      add({attempts_.at({row.getColumn(0).getInt64(), row.getColumn(1).getInt64()})}, row);
    });
  }

  void copy_page_answers() {
    Inserter add = inserter("page_answers", 1, "run_id", rows_[4].columns);
    each_row(rows_[4].select, [&](auto& row) { add({run_of(row)}, row); });
  }

  SQLite::Database& from_;
  const std::int64_t id_;
  SQLite::Database& to_;
  const std::array<SessionRows, 5> rows_;
  std::int64_t session_ = 0;                                                // new id
  std::vector<std::int64_t> runs_;                                          // new ids, in order
  std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> attempts_;  // (trial, number) -> id
};

}  // namespace

std::array<SessionRows, 5> session_rows(SQLite::Database& db) {
  const std::string which_run =
      "(SELECT count(*) FROM runs q WHERE q.session_id = ?1 AND q.id <= t.run_id), 0, ";
  std::array<SessionRows, 5> all{{{"runs", "", ""},
                                  {"notes", "", ""},
                                  {"attempts", "", ""},
                                  {"samples", "", ""},
                                  {"page_answers", "", ""}}};
  for (SessionRows& one : all) one.columns = columns_but_keys(db, one.table);
  all[0].select =
      "SELECT row_number() OVER (ORDER BY t.id), (SELECT sha256 FROM protocols WHERE id = "
      "t.protocol_id), " +
      all[0].columns + " FROM runs t WHERE t.session_id = ?1 ORDER BY t.id";
  all[1].select = "SELECT " + which_run + all[1].columns +
                  " FROM notes t WHERE t.run_id IN (SELECT id FROM runs WHERE session_id = ?1) "
                  "ORDER BY t.run_id, t.id";
  all[2].select = "SELECT " + which_run + all[2].columns +
                  " FROM attempts t WHERE t.session_id = ?1 ORDER BY t.trial, t.attempt";
  all[3].select = "SELECT a.trial, a.attempt, " + all[3].columns +
                  " FROM attempts a JOIN samples t ON t.attempt_id = a.id WHERE a.session_id = ?1 "
                  "ORDER BY a.trial, a.attempt";
  all[4].select = "SELECT " + which_run + all[4].columns +
                  " FROM page_answers t WHERE t.run_id IN (SELECT id FROM runs WHERE session_id = "
                  "?1) ORDER BY t.run_id, t.id";
  return all;
}

bool same_session(SQLite::Database& db_a, std::int64_t id_a, SQLite::Database& db_b,
                  std::int64_t id_b) {
  const auto same = [&](const std::string& sql_a, const std::string& sql_b) {
    SQLite::Statement a(db_a, sql_a), b(db_b, sql_b);
    a.bind(1, id_a);
    b.bind(1, id_b);
    return same_rows(a, b);
  };
  const std::string session =
      "SELECT " + columns_but_keys(db_a, "sessions") + " FROM sessions WHERE id = ?1";
  if (!same(session, session)) return false;
  const auto rows_a = session_rows(db_a), rows_b = session_rows(db_b);
  for (std::size_t i = 0; i < rows_a.size(); ++i) {
    if (!same(rows_a[i].select, rows_b[i].select)) return false;
  }
  return true;
}

void copy_session(SQLite::Database& from, std::int64_t id, SQLite::Database& to,
                  std::int64_t participant) {
  SessionCopier(from, id, to).copy(participant);
}

}  // namespace palpate::data
