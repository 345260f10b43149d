#pragma once
// Internal to data/: a trial as the fields of columns.h, in their order.

#include "data/export/clock.h"
#include "data/export/delimited_row.h"
#include "data/store/store.h"

namespace palpate::data {

/// trial_columns()
void put_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// The same without the first column, participant_id.
void put_trial_but_who(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock);
/// attempt_columns()
void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock);
/// sample_columns(): places to 1 nm, forces to 1 uN and torques to 1 uN m, a thousandth of what any
/// device senses or shows; the database has all digits.
void put_sample(DelimitedRow& row, const SampleRecord& sample);

}  // namespace palpate::data
