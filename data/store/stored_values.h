#pragma once
// Internal to data/store: validates values that were read, which a damaged or edited file may hold.

#include "data/store/store.h"

namespace palpate::data {

/// Together with RowReader, which refuses NULL and booleans other than 0 and 1, these are all of
/// the table's CHECK constraints on an attempt. SQLite's quick_check takes twice as long for them,
/// and skips them on a read-only disk. \throws SQLite::Exception (damage), naming participant,
/// session, trial and field.
void require_valid_run(const StoredTrial& trial);
void require_valid_record(const StoredTrial& trial);

}  // namespace palpate::data
