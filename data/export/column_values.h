#pragma once
// Internal to data/export: the values of the columns that column_definitions.h defines, in the same
// order.

#include <optional>
#include <string>

#include "data/export/clock.h"
#include "data/export/delimited_row.h"
#include "data/store/store.h"

namespace palpate::data {

/// From task on.
struct TaskValues {
  explicit TaskValues(const TrialRecord& record);
  std::string task, block_name;
  std::optional<int> track;
  std::optional<double> level, standard_level;
  std::optional<bool> catch_trial, success;
  std::optional<double> number, confidence, confidence_delay;  // s
  std::optional<int> comparison_interval;
  std::string onsets, ends, levels;
};

/// Missing where no answer is right or wrong.
inline std::optional<bool> correct_of(const TrialRecord& record) {
  if (!has_right_answer(record)) return std::nullopt;
  return record.correct;
}

/// Without the first column, participant_id. \param row  a DelimitedRow or a ColumnTable
template <class Row>
void put_trial_without_participant(Row& row, const StoredTrial& trial, const ExportClock& clock) {
  const TrialRecord& record = trial.record;
  row << record.session << record.block << record.trial << record.renderer << record.shape
      << record.response << correct_of(record) << record.response_time;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice << record.timed_out << record.first_contact_time << clock.onset_utc(trial)
      << trial.run.device << trial.participant.simulated << record.missed_ticks << record.attempt
      << trial.protocol_sha256 << trial.run.program_version << trial.participant.enrolled_number
      << record.started_inside << record.ticks
      << static_cast<double>(record.longest_period_ns) / 1e9 << record.faults << record.max_force
      << trial.run.observer_sha256 << (!record.response.empty() && !record.first_contact_time)
      << trial.run.response_device << record.contact_share << record.edge_dwell;
  if (clock.tasks()) {
    const TaskValues task(record);
    row << task.task << task.block_name << task.track << task.level << task.standard_level
        << task.catch_trial << task.success << task.number << task.confidence
        << task.confidence_delay << task.comparison_interval << task.onsets << task.ends
        << task.levels;
  }
  if (clock.torque().any()) row << clock.torque().driven(trial);
  if (clock.relative()) row << clock.elapsed(trial);
}
/// trial_columns()
template <class Row>
void put_trial(Row& row, const StoredTrial& trial, const ExportClock& clock) {
  row << trial.participant.code;
  put_trial_without_participant(row, trial, clock);
}
/// attempt_columns()
void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock);
/// sample_columns(): positions rounded to 1 nm, forces to 1 uN and torques to 1 uN m, a thousandth
/// of the resolution of any device; the database has all digits.
void put_sample(DelimitedRow& row, const SampleRecord& sample);
/// contact_columns(), places rounded to 1 nm; missing in free space.
void put_contact(DelimitedRow& row, const std::optional<TickContact>& contact);
/// Whether a stimulus of the protocol moves: samples then have body_columns() as well.
bool has_bodies(const ProtocolFacts& facts);
/// body_columns(), rounded to 1e-9 of their unit; missing where nothing moved.
/// \param sample  of the record's own
void put_body(DelimitedRow& row, const TrialRecord& record, const SampleRecord& sample);

}  // namespace palpate::data
