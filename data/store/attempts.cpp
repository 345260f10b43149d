// Writes attempts: one by one as they are shown, or many simulated ones in one transaction.
// begin_attempt commits before anything is shown, so that a crash leaves a trace of the attempt;
// finish_attempt commits its record.

#include "data/store/attempts.h"

#include "data/store/connection.h"
#include "data/store/samples_codec.h"
#include "data/store/statement_values.h"
#include "data/store/task_text.h"
#include "data/store/validation.h"

namespace palpate::data {
namespace {

std::string trial_name(const TrialRecord& record) {
  return "session " + std::to_string(record.session) + ", trial " + std::to_string(record.trial);
}

struct OpenAttempt {
  std::int64_t id = 0;
  TrialRecord plan;
};

/// The attempt of a run that has begun and not ended; there is one at most.
std::optional<OpenAttempt> open_attempt(SQLite::Database& db, const Run& run) {
  SQLite::Statement find(
      db,
      "SELECT id, trial, attempt, block, renderer, shape, practice, orientation_w, orientation_x, "
      "orientation_y, orientation_z FROM attempts WHERE run_id = ? AND state = 'running'");
  Binder(find) << run.id;
  if (!find.executeStep()) return std::nullopt;
  OpenAttempt open;
  RowReader row(find);
  row >> open.id >> open.plan.trial >> open.plan.attempt >> open.plan.block >> open.plan.renderer >>
      open.plan.shape >> open.plan.practice;
  for (double& q : open.plan.orientation_wxyz) row >> q;
  open.plan.session = run.session;
  return open;
}

/// \return its number within the trial: 1, 2, ...
int insert_attempt(SQLite::Database& db, SQLite::Statement& insert, const Run& run,
                   const TrialRecord& plan, std::int64_t began_ns) {
  SQLite::Statement count(db,
                          "SELECT coalesce(max(attempt), 0) FROM attempts WHERE session_id = ? AND "
                          "trial = ?");
  Binder(count) << run.session_id << plan.trial;
  count.executeStep();
  const int attempt = count.getColumn(0).getInt() + 1;
  insert.reset();
  Binder bind(insert);
  bind << run.session_id << run.id << plan.trial << attempt << plan.block << plan.renderer
       << plan.shape << plan.practice;
  for (const double q : plan.orientation_wxyz) bind << q;
  bind << began_ns << (plan.task ? std::optional(task_text(*plan.task)) : std::nullopt);
  insert.exec();
  return attempt;
}

constexpr const char* kInsertAttempt =
    "INSERT INTO attempts (session_id, run_id, trial, attempt, block, renderer, shape, practice, "
    "orientation_w, orientation_x, orientation_y, orientation_z, began_ns, task, state) "
    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'running')";

constexpr const char* kComplete =
    "UPDATE attempts SET state = 'completed', response = ?, correct = ?, timed_out = ?, "
    "response_time = ?, first_contact_time = ?, onset_ns = ?, response_ns = ?, start_tip_x = ?, "
    "start_tip_y = ?, start_tip_z = ?, start_tail_x = ?, start_tail_y = ?, start_tail_z = ?, "
    "ticks = ?, missed_ticks = ?, longest_period_ns = ?, faults = ?, started_inside = ?, "
    "max_force = ?, contact_share = ?, edge_dwell = ?, samples_sha256 = ?, task = ? WHERE id "
    "= ?";

void complete(SQLite::Database& db, SQLite::Statement& update, std::int64_t id,
              const TrialRecord& record) {
  update.reset();
  Binder bind(update);
  bind << record.response << record.correct << record.timed_out << record.response_time
       << record.first_contact_time << record.onset_ns << record.response_ns;
  for (const double x : record.start_tip) bind << x;
  for (const double x : record.start_tail) bind << x;
  bind << record.ticks << record.missed_ticks << record.longest_period_ns << record.faults
       << record.started_inside << record.max_force << record.contact_share << record.edge_dwell;
  const auto count = static_cast<std::int64_t>(record.samples.size());
  const std::string packed = count > 0 ? pack_samples(record.samples, record.bodies) : "";
  const int packing = packing_for(record.bodies);
  bind << (count > 0
               ? std::optional(checksum_of_samples(packing, count, packed.data(), packed.size()))
               : std::nullopt)
       << (record.task ? std::optional(task_text(*record.task)) : std::nullopt) << id;
  update.exec();
  if (count == 0) return;
  SQLite::Statement insert(
      db, "INSERT INTO samples (attempt_id, packing, count, data) VALUES (?, ?, ?, ?)");
  Binder(insert) << id << packing << count;
  insert.bindNoCopy(4, packed.data(), static_cast<int>(packed.size()));
  insert.exec();
}

bool has_record(SQLite::Database& db, const Run& run, int trial) {
  SQLite::Statement find(
      db, "SELECT 1 FROM attempts WHERE session_id = ? AND trial = ? AND state = 'completed'");
  Binder(find) << run.session_id << trial;
  return find.executeStep();
}

}  // namespace

void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason) {
  SQLite::Statement find(db, "SELECT id FROM attempts WHERE run_id = ? AND state = 'running'");
  Binder(find) << run.id;
  if (!find.executeStep()) return;
  const std::int64_t id = find.getColumn(0).getInt64();
  find.reset();
  SQLite::Statement update(
      db, "UPDATE attempts SET state = 'cut_off', cut_off_reason = ? WHERE id = ?");
  Binder(update) << reason << id;
  update.exec();
  seals.attempt(id);
}

int Store::begin_attempt(const Run& run, const TrialRecord& planned, std::int64_t began_ns) {
  Validator validator;
  validate_plan(validator, planned, run.session);
  validator.throw_if_invalid(impl_->path + ": " + trial_name(planned));
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    impl_->require_running(run);
    if (has_record(db, run, planned.trial))
      impl_->refuse(trial_name(planned) + " already has a record");
    if (const auto open = open_attempt(db, run)) {
      impl_->refuse(trial_name(planned) + " cannot begin while trial " +
                    std::to_string(open->plan.trial) + " has not ended");
    }
    SQLite::Statement insert(db, kInsertAttempt);
    return insert_attempt(db, insert, run, planned, began_ns);
  });
}

void Store::finish_attempt(const Run& run, const TrialRecord& record) {
  Validator validator;
  validate_plan(validator, record, run.session);
  validate_outcome(validator, record);
  validator.throw_if_invalid(impl_->path + ": " + trial_name(record));
  impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    const auto open = open_attempt(db, run);
    if (!open) impl_->refuse(trial_name(record) + " has not been begun");
    const TrialRecord& plan = open->plan;
    if (plan.trial != record.trial || plan.attempt != record.attempt ||
        plan.block != record.block || plan.renderer != record.renderer ||
        plan.shape != record.shape || plan.practice != record.practice ||
        plan.orientation_wxyz != record.orientation_wxyz) {
      impl_->refuse("the record of " + trial_name(record) + ", attempt " +
                    std::to_string(record.attempt) +
                    " does not belong to the attempt that was begun (trial " +
                    std::to_string(plan.trial) + ", attempt " + std::to_string(plan.attempt) + ")");
    }
    SQLite::Statement update(db, kComplete);
    complete(db, update, open->id, record);
    impl_->seals->attempt(open->id);
    return true;
  });
}

void Store::cut_off_attempt(const Run& run, const std::string& reason) {
  Validator validator;
  validator.present("reason", reason);
  validator.throw_if_invalid(impl_->path + ": attempt");
  impl_->commit([&] {
    if (!open_attempt(*impl_->db, run)) impl_->refuse("no attempt is open");
    cut_off_open_attempt(*impl_->db, *impl_->seals, run, reason);
    return true;
  });
}

void Store::record_simulated(const Run& run, const std::vector<TrialRecord>& records) {
  for (const auto& record : records) {
    Validator validator;
    validate_plan(validator, record, run.session);
    validate_outcome(validator, record);
    validator.expect(record.attempt == 1, "a simulated trial has one attempt");
    validator.throw_if_invalid(impl_->path + ": " + trial_name(record));
  }
  impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    impl_->require_running(run);
    SQLite::Statement person(db,
                             "SELECT p.simulated FROM sessions s JOIN participants p ON p.id = "
                             "s.participant_id WHERE s.id = ?");
    Binder(person) << run.session_id;
    if (!person.executeStep() || person.getColumn(0).getInt() != 1) {
      impl_->refuse("trials of a real participant are begun and finished one by one");
    }
    SQLite::Statement insert(db, kInsertAttempt), update(db, kComplete);
    for (const auto& record : records) {
      if (has_record(db, run, record.trial))
        impl_->refuse(trial_name(record) + " already has a record");
      insert_attempt(db, insert, run, record, record.onset_ns);
      const std::int64_t id = db.getLastInsertRowid();
      complete(db, update, id, record);
      impl_->seals->attempt(id);
    }
    return true;
  });
}

}  // namespace palpate::data
