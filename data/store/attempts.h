#pragma once
// Internal to data/store: attempts that a run leaves open.

#include <SQLiteCpp/Database.h>

#include <string>

#include "data/store/seal_writer.h"
#include "data/store/store.h"

namespace palpate::data {

/// Within a transaction; no effect where none is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
