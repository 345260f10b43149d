#include "data/merge/merge.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/store/frames.h"
#include "data/store/protocol_rows.h"
#include "data/store/schema.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"
#include "data/store/unmaskings.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

void require_new(const std::string& out) {
  std::error_code error;
  if (out.empty()) throw StoreRefused("'' is not a path of a sweep's file");
  for (const char* end : {"", "-journal", "-wal"}) {
    if (!fs::exists(fs::symlink_status(out + end, error))) continue;
    throw StoreRefused(out + end +
                       ": exists already; merge creates a new file and never replaces one");
  }
  if (belongs_to_database(out)) {
    throw StoreRefused(out +
                       ": is the name of a file that belongs to a database; give another name");
  }
}

void require_same_plan(const SweepPlan& plan, const std::string& first, const SweepFile& other) {
  const std::vector<std::string> reasons = differences(plan, other.plan());
  if (reasons.empty()) return;
  std::string text = other.path() + ": holds another sweep than " + first +
                     ". Differences (first " + first + ", then this file):";
  for (const std::string& reason : reasons) text += "\n  " + reason;
  throw StoreRefused(text);
}

// Compares and copies sessions between databases. Row ids differ between
// databases: rows are compared and copied without keys, in an order of their own.

/// The rows of one table that belong to the session with id ?1.
struct SessionRows {
  const char* table;
  std::string columns;  ///< all but keys, comma-separated
  /// SELECT of kParentColumns values that identify the parent row, then `columns`.
  std::string select;
};

/// Runs: position in the session (1, 2, ...), checksum of the run's own protocol or NULL. Notes,
/// attempts and answers to pages: position of their run, 0. Samples: trial and number of their
/// attempt.
inline constexpr int kParentColumns = 2;

struct FoundParticipant {
  std::int64_t id = 0;
  int number = 0;
  PlannedParticipant person;
};

std::vector<FoundParticipant> participants_of(StationDatabase& station, std::int64_t protocol_id) {
  std::vector<FoundParticipant> all;
  SQLite::Statement find(station.db(),
                         "SELECT id, number, coalesce((SELECT enrolled_number FROM renumberings "
                         "WHERE participant_id = "
                         "id), number), code, simulated, seed FROM participants WHERE protocol_id "
                         "= ? ORDER BY number");
  Binder(find) << protocol_id;
  while (find.executeStep()) {
    FoundParticipant& one = all.emplace_back();
    one.person.station = &station;
    RowReader(find) >> one.id >> one.number >> one.person.enrolled_number >> one.person.code >>
        one.person.simulated >> one.person.seed;
  }
  SQLite::Statement sessions(station.db(),
                             "SELECT number, id FROM sessions WHERE participant_id = ?");
  for (FoundParticipant& one : all) {
    sessions.reset();
    Binder(sessions) << one.id;
    while (sessions.executeStep()) {
      int number = 0;
      std::int64_t id = 0;
      RowReader(sessions) >> number >> id;
      one.person.sessions[number] = {&station, id};
    }
  }
  return all;
}

struct Span {
  double begin = 0, end = 0;  // s since 1970
};

/// From the first start to the last recorded time of a session.
Span span_of(const PlannedSession& session) {
  SQLite::Statement find(
      session.station->db(),
      "SELECT coalesce(min(r.started_utc_ns / 1e9), 0), coalesce(max(r.started_utc_ns / 1e9 + "
      "(max(coalesce(r.ended_ns, r.started_ns), coalesce((SELECT max(max(a.began_ns, "
      "coalesce(a.response_ns, a.began_ns))) FROM attempts a WHERE a.run_id = r.id), "
      "r.started_ns)) - r.started_ns) / 1e9), 0) FROM runs r WHERE r.session_id = ?");
  Binder(find) << session.id;
  find.executeStep();
  Span span;
  RowReader(find) >> span.begin >> span.end;
  return span;
}

class Planner {
 public:
  MergePlan plan(std::deque<StationDatabase>& stations, NumberConflict clash);

 private:
  void add_protocols(StationDatabase& station);
  void add_files(ProtocolInfo& known, StationDatabase& station, std::int64_t protocol_id);
  void add_participant(PlannedProtocol& protocol, FoundParticipant found);
  void assign_numbers(PlannedProtocol& protocol, NumberConflict clash);
  void add_sessions(PlannedParticipant& known, const PlannedParticipant& found);
  void require_same_protocols(const std::deque<StationDatabase>& stations);
  /// \param other_conflicts number of conflicts other than participant numbers
  [[noreturn]] void raise(std::size_t other_conflicts) const;

  MergePlan plan_;
  std::map<std::string, PlannedProtocol> protocols_;                       // by checksum
  std::map<std::string, std::map<std::string, FoundParticipant>> people_;  // checksum -> by code
  std::map<std::string, std::map<const StationDatabase*, std::set<std::string>>>
      names_;                              // -> checksums
  std::map<std::string, bool> withdrawn_;  // codes looked up so far
  std::vector<std::string> conflicts_;
};

MergePlan Planner::plan(std::deque<StationDatabase>& stations, NumberConflict clash) {
  for (StationDatabase& station : stations) {
    guarded(station.path(), [&] {
      plan_.tombstones.add(Tombstones::read(station.db(), station.path()));
      std::ranges::copy(read_unmaskings(station.db(), station.path()),
                        std::back_inserter(plan_.unmaskings));
    });
  }
  std::ranges::sort(plan_.unmaskings, {},
                    [](const Unmasking& one) { return std::pair(one.utc_ns, one.person); });
  for (StationDatabase& station : stations)
    guarded(station.path(), [&] { add_protocols(station); });
  require_same_protocols(stations);
  const std::size_t other_conflicts = conflicts_.size();
  for (auto& [sha256, protocol] : protocols_) assign_numbers(protocol, clash);
  if (!conflicts_.empty()) raise(other_conflicts);
  for (auto& [sha256, protocol] : protocols_) {
    for (const auto& [number, person] : protocol.participants) {
      plan_.sessions += static_cast<std::int64_t>(person.sessions.size());
    }
    plan_.protocols.push_back(std::move(protocol));
  }
  std::sort(plan_.protocols.begin(), plan_.protocols.end(), [](const auto& a, const auto& b) {
    return std::pair(a.info.name, a.info.sha256) < std::pair(b.info.name, b.info.sha256);
  });
  return std::move(plan_);
}

void Planner::raise(std::size_t other_conflicts) const {
  std::string message = "these databases cannot be merged; nothing was written:";
  for (const std::string& one : conflicts_) message += "\n  " + one;
  if (conflicts_.size() > other_conflicts) {
    message +=
        "\nTwo stations gave the same number: --renumber gives another number to the participant "
        "who began later, and records the number that ordered the trials. Keep the stations' "
        "numbers "
        "apart from now on with palpate run --number";
  }
  if (other_conflicts > 0) {
    message +=
        "\nLeave one of the databases out, or remove a misplaced participant from "
        "a copy of it with palpate forget";
  }
  throw StoreRefused(message);
}

void Planner::add_protocols(StationDatabase& station) {
  SQLite::Statement find(station.db(), "SELECT id, name, sha256, text FROM protocols ORDER BY id");
  while (find.executeStep()) {
    std::int64_t id = 0;
    ProtocolInfo found;
    RowReader(find) >> id >> found.name >> found.sha256 >> found.text;
    names_[found.name][&station].insert(found.sha256);
    PlannedProtocol& protocol = protocols_[found.sha256];
    if (protocol.info.sha256.empty()) protocol.info = found;
    if (protocol.info.text != found.text || protocol.info.name != found.name) {
      conflicts_.push_back(station.path() + ": protocol " + found.name +
                           " has the checksum of another protocol: the file is damaged");
      continue;
    }
    add_files(protocol.info, station, id);
    for (FoundParticipant& one : participants_of(station, id)) {
      const std::string code = one.person.code;
      if (!is_participant_code(code)) {
        throw SQLite::Exception("a participant's code is not 1 to 32 letters and digits",
                                SQLITE_CORRUPT);
      }
      auto [at, unknown] = withdrawn_.try_emplace(code, false);
      if (unknown) at->second = plan_.tombstones.holds(code);
      if (at->second) {
        plan_.excluded.push_back({code, station.path()});
      } else {
        add_participant(protocol, std::move(one));
      }
    }
  }
}

/// Earlier versions did not store the files, so a station may lack them.
void Planner::add_files(ProtocolInfo& known, StationDatabase& station, std::int64_t protocol_id) {
  for (ProtocolFile& file : protocol_files(station.db(), protocol_id)) {
    const auto at = std::lower_bound(known.files.begin(), known.files.end(), file.name,
                                     [](const auto& a, const auto& name) { return a.name < name; });
    if (at == known.files.end() || at->name != file.name) {
      known.files.insert(at, std::move(file));
    } else if (at->bytes != file.bytes) {
      conflicts_.push_back(station.path() + ": " + file.name + " of protocol " + known.name +
                           " differs from the file of another station");
    }
  }
}

void Planner::add_participant(PlannedProtocol& protocol, FoundParticipant found) {
  const std::string code = found.person.code;
  auto& people = people_[protocol.info.sha256];
  const auto at = people.find(code);
  if (at == people.end()) {
    people.emplace(code, std::move(found));
    return;
  }
  FoundParticipant& known = at->second;
  const std::string where = " (" + known.person.station->path() + ", " +
                            found.person.station->path() + ", protocol " + protocol.info.name + ")";
  const int known_order = known.person.enrolled_number, order = found.person.enrolled_number;
  if (known_order != order) {
    conflicts_.push_back("participant " + code + " has number " + std::to_string(known_order) +
                         " and number " + std::to_string(order) + where);
  } else if (known.person.simulated != found.person.simulated ||
             known.person.seed != found.person.seed) {
    conflicts_.push_back("participant " + code +
                         " is simulated at one station and a person at the other, or simulated "
                         "with another seed" +
                         where);
  } else {
    // One of the two was renumbered by an earlier merge: keeps that number.
    if (known.number == order) {
      known.number = found.number;
    } else if (found.number != order) {
      known.number = std::min(known.number, found.number);
    }
    add_sessions(known.person, found.person);
  }
}

/// Participants enrolled with a number come before those renumbered to it; among equals, the first
/// to begin keeps it.
void Planner::assign_numbers(PlannedProtocol& protocol, NumberConflict clash) {
  std::vector<std::pair<std::tuple<int, bool, double, std::string>, FoundParticipant*>> ordered;
  for (auto& [code, one] : people_[protocol.info.sha256]) {
    double began = std::numeric_limits<double>::infinity();
    for (const auto& [number, session] : one.person.sessions)
      began = std::min(began, span_of(session).begin);
    ordered.push_back({{one.number, one.number != one.person.enrolled_number, began, code}, &one});
  }
  std::sort(ordered.begin(), ordered.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  int last = ordered.empty() ? 0 : ordered.back().second->number;
  for (auto& [rank, one] : ordered) {
    const auto holder = protocol.participants.find(one->number);
    int number = one->number;
    if (holder != protocol.participants.end()) {
      const PlannedParticipant& other = holder->second;
      if (clash == NumberConflict::refuse) {
        conflicts_.push_back("number " + std::to_string(number) + " is that of participant " +
                             other.code + " and of participant " + one->person.code + " (" +
                             other.station->path() + ", " + one->person.station->path() +
                             ", protocol " + protocol.info.name + ")");
        continue;
      }
      number = ++last;
      plan_.renumbered.push_back({one->person.code, other.code, one->person.station->path(),
                                  one->person.enrolled_number, number});
    }
    protocol.participants.emplace(number, std::move(one->person));
  }
}

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

/// runs, notes, attempts, samples, page_answers: in the order of insertion that foreign keys need.
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

/// Whether two sessions are identical to the bit.
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

void Planner::add_sessions(PlannedParticipant& known, const PlannedParticipant& found) {
  const auto conflict = [&](const PlannedSession& other, const std::string& what) {
    conflicts_.push_back("participant " + known.code + ": " + what + " (" + other.station->path() +
                         ", " + found.station->path() + ")");
  };
  const auto before = known.sessions;
  for (const auto& [number, session] : found.sessions) {
    const auto same = before.find(number);
    if (same != before.end()) {
      const PlannedSession& other = same->second;
      if (!same_session(other.station->db(), other.id, session.station->db(), session.id)) {
        conflict(other, "session " + std::to_string(number) +
                            " is not the same: two people under one code, or one database is an "
                            "older copy of the other");
      }
      continue;
    }
    const Span now = span_of(session);
    for (const auto& [other_number, other] : before) {
      if (known.simulated || found.sessions.contains(other_number)) continue;
      const Span then = span_of(other);
      if (now.begin > then.end || then.begin > now.end) continue;
      conflict(other, "sessions " + std::to_string(other_number) + " and " +
                          std::to_string(number) + " were at the same time: two people");
    }
    known.sessions[number] = session;
  }
}

/// A station that changed a protocol has several versions (checksums) of its name. Two stations ran
/// different studies if neither has all versions of the other.
void Planner::require_same_protocols(const std::deque<StationDatabase>& stations) {
  for (const auto& [name, by_station] : names_) {
    for (std::size_t i = 0; i < stations.size(); ++i) {
      for (std::size_t k = i + 1; k < stations.size(); ++k) {
        const StationDatabase &a = stations[i], &b = stations[k];
        const auto of_a = by_station.find(&a), of_b = by_station.find(&b);
        if (of_a == by_station.end() || of_b == by_station.end()) continue;
        const auto &one = of_a->second, &other = of_b->second;
        if (std::includes(one.begin(), one.end(), other.begin(), other.end()) ||
            std::includes(other.begin(), other.end(), one.begin(), one.end())) {
          continue;
        }
        conflicts_.push_back("protocol " + name + " is not the same in " + a.path() + " (SHA-256 " +
                             one.begin()->substr(0, 12) + "...) and " + b.path() + " (" +
                             other.begin()->substr(0, 12) + "...)");
      }
    }
  }
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
    copy_frames();
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
  void copy_frames() {
    if (!has_frames(from_, from_.getFilename())) return;
    each_row("SELECT trial, attempt, id FROM attempts WHERE session_id = ?1", [&](auto& row) {
      write_frames(to_, attempts_.at({row.getColumn(0).getInt64(), row.getColumn(1).getInt64()}),
                   read_frames(from_, row.getColumn(2).getInt64()));
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

/// Inserts a copy of a session. \param participant its participant's id in `to`.
/// \throws SQLite::Exception: rows of the session refer to another session.
void copy_session(SQLite::Database& from, std::int64_t id, SQLite::Database& to,
                  std::int64_t participant) {
  SessionCopier(from, id, to).copy(participant);
}

void require_free(const std::string& out) {
  std::error_code error;
  if (out.empty()) throw StoreRefused("'' is not a path of a database");
  for (const char* end : {"", "-wal", "-shm", "-journal"}) {
    if (!fs::exists(fs::symlink_status(out + end, error))) continue;
    throw StoreRefused(
        out + end +
        ": exists already; merge creates a new database and never replaces one; give "
        "another name or move it away");
  }
  if (belongs_to_database(out)) {
    throw StoreRefused(
        out + ": is the name of a file that belongs to another database; give another name");
  }
}

/// Opens every file once, even if it is given several times or by several names.
std::deque<StationDatabase> open_stations(const std::vector<std::string>& inputs,
                                          const AtomicFolder& scratch) {
  std::deque<StationDatabase> stations;
  std::vector<FileIdentity> seen;
  for (const std::string& input : inputs) {
    const FileIdentity identity = identity_of(input);
    if (std::find(seen.begin(), seen.end(), identity) != seen.end()) continue;
    if (identity != FileIdentity{}) seen.push_back(identity);
    stations.emplace_back(input, scratch / ("station-" + std::to_string(stations.size()) + ".db"));
  }
  return stations;
}

/// Copies rows; one that violates a constraint of the new database means that its source is
/// damaged.
template <class Work>
void copy_from(const StationDatabase& station, Work&& work) {
  guarded(station.path(), [&] {
    try {
      work();
    } catch (const SQLite::Exception& error) {
      if (error.getErrorCode() != SQLITE_CONSTRAINT) throw;
      throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
    }
  });
}

/// \return row id
std::int64_t insert_participant(SQLite::Database& db, std::int64_t protocol_id, int number,
                                const PlannedParticipant& person) {
  SQLite::Statement enrol(db,
                          "INSERT INTO participants (protocol_id, code, number, simulated, seed) "
                          "VALUES (?, ?, ?, ?, ?)");
  Binder(enrol) << protocol_id << person.code << number << person.simulated << person.seed;
  copy_from(*person.station, [&] { enrol.exec(); });
  const std::int64_t participant = db.getLastInsertRowid();
  if (person.enrolled_number == number) return participant;
  SQLite::Statement renumber(
      db, "INSERT INTO renumberings (participant_id, enrolled_number) VALUES (?, ?)");
  Binder(renumber) << participant << person.enrolled_number;
  renumber.exec();
  return participant;
}

/// Inserts in the order of the plan, so that the bytes do not depend on the order of the inputs.
void fill(SQLite::Database& db, const std::string& out, const MergePlan& plan,
          const std::function<void(std::int64_t, std::int64_t)>& progress) {
  std::int64_t sessions = 0;
  for (const PlannedProtocol& protocol : plan.protocols)
    insert_protocol_if_absent(db, out, protocol.info);
  for (const PlannedProtocol& protocol : plan.protocols) {
    const std::int64_t protocol_id = insert_protocol_if_absent(db, out, protocol.info);
    for (const auto& [number, person] : protocol.participants) {
      const std::int64_t participant = insert_participant(db, protocol_id, number, person);
      for (const auto& [session_number, session] : person.sessions) {
        copy_from(*session.station, [&, &source = session] {
          copy_session(source.station->db(), source.id, db, participant);
        });
        if (progress) progress(++sessions, plan.sessions);
      }
    }
  }
  for (const Unmasking& one : plan.unmaskings) write_unmasking(db, out, one);
  // `cleared`: no row of the withdrawn participants was ever in this file.
  for (const auto& tombstone : plan.tombstones.all()) Tombstones::put(db, tombstone, true);
}

void sync_file(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!done) throw StoreError(file + ": cannot be written: " + write_fault(error));
}

/// \throws StoreRefused with every conflict, a line each.
MergePlan plan_merge(std::deque<StationDatabase>& stations, NumberConflict clash) {
  return Planner().plan(stations, clash);
}

}  // namespace

SweepMergeResult merge_sweeps(const std::string& out, const std::vector<std::string>& inputs,
                              const std::function<void(std::int64_t)>& progress) {
  require_new(out);
  if (inputs.empty()) throw StoreRefused("no file to merge");
  const AtomicFolder folder(out);
  SweepMergeResult done;
  std::optional<SweepCopy> copy;
  std::vector<FileIdentity> seen;
  std::int64_t files = 0;
  for (const std::string& input : inputs) {
    const FileIdentity identity = identity_of(input);
    if (std::find(seen.begin(), seen.end(), identity) != seen.end()) continue;
    if (identity != FileIdentity{}) seen.push_back(identity);
    SweepFile file = SweepFile::open(input, SweepFile::Writers::none);
    if (!copy) {
      done.plan = file.plan();
      copy.emplace(folder / "merged.sweep", done.plan);
    }
    require_same_plan(done.plan, inputs.front(), file);
    copy->add(file);
    if (progress) progress(++files);
  }
  std::tie(done.points, done.failed) = copy->finish();
  if (!rename_if_absent(folder / "merged.sweep", out)) {
    throw StoreRefused(out + ": another program has created it meanwhile; nothing was written");
  }
  return done;
}

MergeResult merge(const std::string& out, const std::vector<std::string>& inputs,
                  const std::function<void(std::int64_t, std::int64_t)>& progress,
                  NumberConflict clash) {
  require_free(out);
  const AtomicFolder folder(out);
  std::deque<StationDatabase> stations = open_stations(inputs, folder);
  const MergePlan plan = plan_merge(stations, clash);
  const std::string temporary = folder / "merged.db";
  create_database(temporary);
  guarded(out, [&] {
    SQLite::Database db(temporary, SQLite::OPEN_READWRITE);
    // A temporary file, deleted if anything fails: needs no journal.
    db.exec("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA foreign_keys = ON");
    SQLite::Transaction transaction(db);
    fill(db, out, plan, progress);
    transaction.commit();
    db.exec("PRAGMA journal_mode = WAL");
  });
  for (const StationDatabase& station : stations) station.require_unchanged();
  MergeResult done{Store::open(temporary, Store::Mode::read_only).counts(), plan.excluded,
                   plan.renumbered};
  sync_file(temporary);
  if (!rename_if_absent(temporary, out)) {
    throw StoreRefused(
        out + ": another program has created it meanwhile; nothing was written, give another name");
  }
  return done;
}

}  // namespace palpate::data
