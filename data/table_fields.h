#pragma once
// Internal to data/: a trial as the fields of columns.h, in their order.

#include "data/store.h"
#include "data/table_row.h"

namespace palpate {

void put_trial(TableRow& row, const StoredTrial& trial);  ///< trial_columns()
/// The same without the first column, participant_id.
void put_trial_but_who(TableRow& row, const StoredTrial& trial);
void put_attempt(TableRow& row, const StoredTrial& attempt);  ///< attempt_columns()
void put_sample(TableRow& row, const SampleRecord& sample);   ///< sample_columns()

}  // namespace palpate
