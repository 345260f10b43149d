#pragma once
// Internal to data/store: ends the attempt that a run has left open. Called when a run ends, and by
// the next writer for runs whose process died.

#include <SQLiteCpp/Database.h>

#include <string>

#include "data/store/seal_writer.h"
#include "data/store/store.h"

namespace palpate::data {

/// Within a transaction of the caller; no effect where no attempt is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
