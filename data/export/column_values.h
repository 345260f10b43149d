#pragma once
// Internal to data/export: the values of the columns that column_definitions.h defines, in the same
// order.

#include "data/export/clock.h"
#include "data/export/delimited_row.h"
#include "data/store/store.h"

namespace palpate::data {

/// Without the first column, participant_id. \param row  a DelimitedRow or a ColumnTable
template <class Row>
void put_trial_without_participant(Row& row, const StoredTrial& trial, const ExportClock& clock) {
  const TrialRecord& record = trial.record;
  row << record.session << record.block << record.trial << record.renderer << record.shape
      << record.response << record.correct << record.response_time;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice << record.timed_out << record.first_contact_time << clock.onset_utc(trial)
      << trial.run.device << trial.participant.simulated << record.missed_ticks << record.attempt
      << trial.protocol_sha256 << trial.run.program_version << trial.participant.enrolled_number
      << record.started_inside << record.ticks
      << static_cast<double>(record.longest_period_ns) / 1e9 << record.faults << record.max_force
      << trial.run.observer_sha256 << (!record.response.empty() && !record.first_contact_time)
      << trial.run.response_device << record.contact_share << record.edge_dwell;
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

}  // namespace palpate::data
