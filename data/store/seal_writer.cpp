#include "data/store/seal_writer.h"

#include <sqlite3.h>

#include <vector>

#include "data/store/record_columns.h"
#include "data/store/statement_values.h"

namespace palpate::data {
namespace {

constexpr int kVersion = 3;  // of the schema that brought the seals

/// Of the schema: the rows of an older database are sealed before it has the columns of today.
int version_of(SQLite::Database& db) {
  SQLite::Statement tasks(db, "SELECT 1 FROM pragma_table_info('attempts') WHERE name = 'task'");
  if (tasks.executeStep()) return 5;
  SQLite::Statement find(
      db, "SELECT 1 FROM pragma_table_info('attempts') WHERE name = 'contact_share'");
  return find.executeStep() ? 4 : kVersion;
}

std::vector<std::int64_t> ids(SQLite::Database& db, const char* sql, std::int64_t of = 0) {
  SQLite::Statement find(db, sql);
  if (find.getBindParameterCount() > 0) find.bind(1, of);
  std::vector<std::int64_t> all;
  while (find.executeStep()) all.push_back(find.getColumn(0).getInt64());
  return all;
}

void require_row(SQLite::Statement& find) {
  if (!find.executeStep()) throw SQLite::Exception("a row to be sealed is missing", SQLITE_CORRUPT);
}

}  // namespace

/// The last link of a session in the database; link 0 (the session itself) where there is none.
const Link& SealWriter::last_of(std::int64_t session) {
  const auto known = last_.find(session);
  if (known != last_.end()) return known->second;
  Link link;
  const std::string pages =
      version_of(db_) < 5 ? ""
                          : "UNION ALL SELECT p.link, p.seal FROM page_answers p JOIN runs r ON "
                            "r.id = p.run_id WHERE r.session_id = ?1";
  SQLite::Statement find(db_,
                         "SELECT * FROM (SELECT link, seal FROM attempts WHERE session_id = ?1 "
                         "UNION ALL SELECT link, seal FROM runs WHERE session_id = ?1 UNION ALL "
                         "SELECT end_link, end_seal FROM runs WHERE session_id = ?1 UNION ALL "
                         "SELECT n.link, n.seal FROM notes n JOIN runs r ON r.id = n.run_id WHERE "
                         "r.session_id = ?1 " +
                             pages + ") WHERE link IS NOT NULL ORDER BY link DESC LIMIT 1");
  Binder(find) << session;
  if (find.executeStep()) {
    RowReader(find) >> link.position >> link.seal;
  } else {
    SealedValues whose;
    put_session(whose, read_session_head(db_, session, kVersion));
    link.seal = whose.seal({});
  }
  return last_.emplace(session, link).first->second;
}

void SealWriter::seal(const char* update, std::int64_t session, std::int64_t id) {
  const Link& previous = last_of(session);
  const Link link{previous.position + 1, values_.seal(previous.seal)};
  SQLite::Statement write(db_, update);
  Binder(write) << link.position << link.seal << id;
  write.exec();
  last_[session] = link;
}

void SealWriter::run(std::int64_t id) {
  SQLite::Statement find(db_, "SELECT r.session_id, " + run_columns(kVersion) +
                                  " FROM runs r JOIN sessions s ON s.id = r.session_id WHERE r.id "
                                  "= ?");
  Binder(find) << id;
  require_row(find);
  std::int64_t session = 0;
  RunInfo info;
  RowReader row(find);
  row >> session >> info;
  put_run(values_, info);
  seal("UPDATE runs SET link = ?, seal = ? WHERE id = ?", session, id);
}

void SealWriter::note(std::int64_t id) {
  SQLite::Statement find(db_,
                         "SELECT r.session_id, r.link, n.at_ns, n.text FROM notes n JOIN runs r ON "
                         "r.id = n.run_id WHERE n.id = ?");
  Binder(find) << id;
  require_row(find);
  std::int64_t session = 0, run_link = 0, at_ns = 0;
  std::string text;
  RowReader(find) >> session >> run_link >> at_ns >> text;
  put_note(values_, run_link, at_ns, text);
  seal("UPDATE notes SET link = ?, seal = ? WHERE id = ?", session, id);
}

void SealWriter::page_answer(std::int64_t id) {
  SQLite::Statement find(db_, std::string("SELECT r.session_id, r.link, ") + kPageAnswerColumns +
                                  " FROM page_answers p JOIN runs r ON r.id = p.run_id WHERE p.id "
                                  "= ?");
  Binder(find) << id;
  require_row(find);
  std::int64_t session = 0, run_link = 0;
  PageAnswer answer;
  RowReader(find) >> session >> run_link >> answer;
  put_page_answer(values_, run_link, answer);
  seal("UPDATE page_answers SET link = ?, seal = ? WHERE id = ?", session, id);
}

void SealWriter::end(std::int64_t run_id) {
  SQLite::Statement find(db_,
                         "SELECT session_id, link, end_reason, ended_ns FROM runs WHERE id = ?");
  Binder(find) << run_id;
  require_row(find);
  std::int64_t session = 0, run_link = 0;
  std::string reason;
  std::optional<std::int64_t> ended_ns;
  RowReader(find) >> session >> run_link >> reason >> ended_ns;
  put_end(values_, run_link, reason, ended_ns);
  seal("UPDATE runs SET end_link = ?, end_seal = ? WHERE id = ?", session, run_id);
}

void SealWriter::attempt(std::int64_t id) {
  if (!find_attempt_) {
    find_attempt_.emplace(
        db_, std::string("SELECT a.session_id, r.link, ") + kPlanColumns +
                 ", a.cut_off_reason, a.samples_sha256, " + task_column(version_of(db_)) +
                 outcome_columns(version_of(db_)) +
                 " FROM attempts a JOIN runs r ON r.id = a.run_id WHERE a.id = ?");
    seal_attempt_.emplace(db_, "UPDATE attempts SET link = ?, seal = ? WHERE id = ?");
  }
  SQLite::Statement& find = *find_attempt_;
  find.reset();
  Binder(find) << id;
  require_row(find);
  std::int64_t session = 0;
  AttemptSealed about;
  TrialRecord record;
  RowReader row(find);
  row >> session >> about.run_link;
  read_plan(row, record);
  about.began_ns = record.onset_ns;
  row >> about.cut_off_reason >> about.samples;
  read_task(row, record);
  if (!about.cut_off_reason) read_outcome(row, record);
  find.reset();
  put_attempt(values_, about, record);
  const Link& previous = last_of(session);
  const Link link{previous.position + 1, values_.seal(previous.seal)};
  seal_attempt_->reset();
  Binder(*seal_attempt_) << link.position << link.seal << id;
  seal_attempt_->exec();
  seal_attempt_->reset();
  last_[session] = link;
}

void SealWriter::seal_existing_rows() {
  for (const std::int64_t id : ids(db_, "SELECT attempt_id FROM samples")) {
    SQLite::Statement find(db_, "SELECT packing, count, data FROM samples WHERE attempt_id = ?");
    Binder(find) << id;
    require_row(find);
    const SQLite::Column data = find.getColumn(2);
    const void* const bytes = data.getBlob();
    SQLite::Statement write(db_, "UPDATE attempts SET samples_sha256 = ? WHERE id = ?");
    Binder(write) << checksum_of_samples(find.getColumn(0).getInt(), find.getColumn(1).getInt64(),
                                         bytes, static_cast<std::size_t>(data.getBytes()))
                  << id;
    write.exec();
  }
  for (const std::int64_t run_id : ids(db_, "SELECT id FROM runs ORDER BY id")) {
    run(run_id);
    for (const std::int64_t id :
         ids(db_,
             "SELECT id FROM attempts WHERE run_id = ? AND state <> 'running' ORDER BY trial, "
             "attempt",
             run_id)) {
      attempt(id);
    }
    for (const std::int64_t id :
         ids(db_, "SELECT id FROM notes WHERE run_id = ? ORDER BY id", run_id))
      note(id);
    if (!ids(db_, "SELECT 1 FROM runs WHERE id = ? AND end_reason <> 'running'", run_id).empty())
      end(run_id);
  }
}

}  // namespace palpate::data
