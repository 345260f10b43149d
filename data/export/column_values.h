#pragma once
// The values of the columns that exported_columns.h defines, in the same order.

#include <optional>
#include <span>

#include "data/base/cell_name.h"
#include "data/export/clock.h"
#include "data/export/delimited_row.h"
#include "data/export/exported_columns.h"
#include "data/store/store.h"
#include "data/trial_columns.h"

namespace palpate::data {

/// Missing where no answer is right or wrong.
inline std::optional<bool> correct_of(const TrialRecord& record) {
  if (!has_right_answer(record)) return std::nullopt;
  return record.correct;
}

/// The levels of the factors, in the order of clock.factors().
template <class Row>
void put_factors(Row& row, const TrialRecord& record, const ExportClock& clock) {
  if (clock.factors().empty()) return;
  const CellName name = cell_name(record.shape);
  for (const StoredFactor& factor : clock.factors()) row << name.level(factor.name);
}

/// The columns of every trial, after the participant. \param row  a DelimitedRow or a ColumnTable
template <class Row>
void put_plain_columns(Row& row, const StoredTrial& trial, const ExportClock& clock) {
  const TrialRecord& record = trial.record;
  row << record.session << record.block << record.trial << record.renderer
      << base_name(record.shape) << record.response << correct_of(record) << record.response_time;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice;
  put_factors(row, record, clock);
  row << record.timed_out << record.first_contact_time << clock.onset_utc(trial) << trial.run.device
      << trial.participant.simulated << record.missed_ticks << record.attempt
      << trial.protocol_sha256 << trial.run.program_version << trial.participant.enrolled_number
      << record.started_inside << record.ticks
      << static_cast<double>(record.longest_period_ns) / 1e9 << record.faults << record.max_force
      << trial.run.observer_sha256 << (!record.response.empty() && !record.first_contact_time)
      << trial.run.response_device;
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    if (*column.description) row << value;
  });
}
/// columns_of_trial()
void put_columns_of_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// trial_columns()
void put_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// attempt_columns()
void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock);
/// sample_columns(): positions rounded to 1 nm, forces to 1 uN and torques to 1 uN m, a thousandth
/// of the resolution of any device; the database has all digits.
void put_sample(DelimitedRow& row, const SampleRecord& sample);
/// contact_columns(), positions rounded to 1 nm; missing in free space.
void put_contact(DelimitedRow& row, const std::optional<TickContact>& contact);
/// \param columns  DatasetForm::intervals
void put_interval(DelimitedRow& row, std::span<const Column> columns, int interval);
/// Whether a stimulus of the protocol moves: samples then have body_columns() as well.
bool has_bodies(const ProtocolFacts& facts);
/// body_columns(), rounded to 1e-9 of their unit; missing if the stimulus is at rest.
/// \param sample  an element of record.samples
void put_body(DelimitedRow& row, const TrialRecord& record, const SampleRecord& sample);

}  // namespace palpate::data
