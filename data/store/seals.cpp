#include "data/store/seals.h"

#include <nettle/sha2.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <vector>

#include "data/errors.h"
#include "data/store/record_columns.h"
#include "data/store/schema.h"
#include "data/store/statement.h"
#include "data/store/task_text.h"
#include "data/trial_columns.h"

namespace palpate::data {
namespace {

/// Version of the schema: rows of an older database are sealed before migration adds columns.
int version_of(SQLite::Database& db) {
  int version = kSealsSince;
  SQLite::Statement columns(db, "SELECT name FROM pragma_table_info('attempts')");
  while (columns.executeStep()) {
    const std::string name = columns.getColumn(0).getString();
    if (name == "task") version = std::max(version, 5);
    for (const MeasuredColumn& measured : kMeasured) {
      if (name == measured.name) version = std::max(version, measured.since);
    }
  }
  return version;
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

Checksum finish_sum(sha256_ctx& context) {
  Checksum sum;
  sha256_digest(&context, sum.size(), sum.data());
  return sum;
}

/// Number of measured columns that this version of the schema added.
constexpr int measured_by(int version) {
  int n = 0;
  for (const MeasuredColumn& column : kMeasured) n += column.since == version ? 1 : 0;
  return n;
}

template <class T>
bool is_present(const T&) {
  return true;
}
bool is_present(const std::optional<double>& value) { return value.has_value(); }

/// Appends those columns, unless all are null. From version 5 on the version comes first, to
/// distinguish the groups.
void put_measured(SealedValues& out, const TrialRecord& record, int version) {
  bool any = false;
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    if (column.since == version) any = any || is_present(value);
  });
  if (!any) return;
  if (version > 4) out << version;
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    if (column.since == version) out << value;
  });
}

}  // namespace

/// The last link of a session in the database; or link 0 (the session itself) if there is none.
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
    put_session(whose, read_session_head(db_, session, kSealsSince));
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
  SQLite::Statement find(db_, "SELECT r.session_id, " + run_columns(kSealsSince) +
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

Checksum SealedValues::seal(const Checksum& previous) const {
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, previous.size(), previous.data());
  sha256_update(&context, size_, bytes_.data());
  return finish_sum(context);
}

Checksum checksum_of_samples(int packing, std::int64_t count, const void* data, std::size_t size) {
  std::array<unsigned char, 12> head{};
  for (std::size_t i = 0; i < 4; ++i) head[i] = static_cast<unsigned char>(packing >> 8 * i);
  for (std::size_t i = 0; i < 8; ++i) head[4 + i] = static_cast<unsigned char>(count >> 8 * i);
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, head.size(), head.data());
  sha256_update(&context, size, static_cast<const unsigned char*>(data));
  return finish_sum(context);
}

void put_session(SealedValues& out, const SessionHead& session) {
  const Participant& person = session.participant;
  out.begin("session") << session.protocol_sha256 << session.protocol_name << person.code
                       << person.enrolled_number << person.simulated
                       << (person.seed ? std::optional(std::to_string(*person.seed)) : std::nullopt)
                       << session.number << session.observer_sha256;
}

void put_run(SealedValues& out, const RunInfo& info) {
  out.begin("run") << info.clock.utc_ns << info.clock.monotonic_ns << info.program_version
                   << info.build << info.device << info.device_calibration << info.response_device
                   << info.response_latency << info.consent_version << info.consent_utc_ns
                   << info.hand
                   << (info.protocol_sha256.empty() ? std::nullopt
                                                    : std::optional(info.protocol_sha256))
                   << info.files_sha256;
}

void put_note(SealedValues& out, std::int64_t run_link, std::int64_t at_ns,
              const std::string& text) {
  out.begin("note") << run_link << at_ns << text;
}

void put_attempt(SealedValues& out, const AttemptSealed& attempt, const TrialRecord& record) {
  out.begin("attempt") << attempt.run_link << record.trial << record.attempt << record.block
                       << record.renderer << record.shape << record.practice;
  for (const double q : record.orientation_wxyz) out << q;
  out << attempt.began_ns;
  if (attempt.cut_off_reason) {
    out << std::string("cut_off") << *attempt.cut_off_reason;
    constexpr int kOutcomes = 13;  // columns from response to start_tail_z
    for (int i = 0; i < kOutcomes + measured_by(1); ++i) out << std::optional<int>();
  } else {
    out << std::string("completed") << std::optional<int>() << record.response << record.correct
        << record.timed_out << record.response_time << record.first_contact_time << record.onset_ns
        << record.response_ns;
    for (const double x : record.start_tip) out << x;
    for (const double x : record.start_tail) out << x;
    put_measured(out, record, 1);
  }
  out << attempt.samples;
  put_measured(out, record, 4);
  if (const auto task = task_text(record.task)) out << *task;
  for (int version = 5; version <= kSchemaVersion; ++version) put_measured(out, record, version);
}

void put_page_answer(SealedValues& out, std::int64_t run_link, const PageAnswer& answer) {
  out.begin("page") << run_link << answer.page << answer.item << answer.version
                    << answer.text_sha256 << answer.answer << answer.at_ns;
}

void put_end(SealedValues& out, std::int64_t run_link, const std::string& reason,
             std::optional<std::int64_t> ended_ns) {
  out.begin("end") << run_link << reason << ended_ns;
}

void ChainCheck::fail(const RowName& name, const char* what) const {
  std::string text = session_ + ", " + name.kind;
  if (name.number > 0) text += " " + std::to_string(name.number);
  if (name.attempt > 0) text += ", attempt " + std::to_string(name.attempt);
  throw StoreRefused(text + what +
                     "; restore a backup (correct data in the analysis or in a copy of an export, "
                     "not in the database)");
}

void ChainCheck::take(const Checksum& seal, const SealedValues& values, const RowName& name) {
  if (values.seal(last_) != seal) {
    fail(name, links_ > 0 ? ": was changed since it was recorded: it does not match its seal"
                          : ", or its participant, protocol or settings, was "
                            "changed since it was recorded: it does not match its seal");
  }
  last_ = seal;
  ++links_;
}

void ChainCheck::add(const std::optional<Link>& link, const SealedValues& values,
                     const RowName& name) {
  if (!link) fail(name, ": has no seal: palpate did not record it");
  if (link->position != links_ + 1) {
    const bool added =
        link->position > links_ &&
        waiting_.try_emplace(link->position, Waiting{link->seal, values, name}).second;
    if (!added) fail(name, ": is at the position of another sealed row");
    return;
  }
  take(link->seal, values, name);
  for (auto next = waiting_.begin(); next != waiting_.end() && next->first == links_ + 1;
       next = waiting_.erase(next)) {
    take(next->second.seal, next->second.values, next->second.name);
  }
}

void ChainCheck::finish() const {
  if (waiting_.empty()) return;
  fail(waiting_.begin()->second.name, ": rows before it are missing");
}

}  // namespace palpate::data
