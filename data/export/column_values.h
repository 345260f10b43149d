#pragma once
// Internal to data/export: the values of the columns that column_definitions.h defines, in the same
// order.

#include "data/export/clock.h"
#include "data/export/delimited_row.h"
#include "data/store/store.h"

namespace palpate::data {

/// trial_columns()
void put_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// Without the first column, participant_id.
void put_trial_without_participant(DelimitedRow& row, const StoredTrial& trial,
                                   const ExportClock& clock);
/// attempt_columns()
void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock);
/// sample_columns(): positions rounded to 1 nm, forces to 1 uN and torques to 1 uN m, a thousandth
/// of the resolution of any device; the database has all digits.
void put_sample(DelimitedRow& row, const SampleRecord& sample);

}  // namespace palpate::data
