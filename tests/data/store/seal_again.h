#pragma once

#include <SQLiteCpp/Database.h>

#include "data/store/seals.h"

namespace palpate::data::testing {

/// Forges all seals: recomputes each from the current values of its row.
inline void seal_again(SQLite::Database& db) {
  db.exec(
      "UPDATE runs SET link = NULL, seal = NULL, end_link = NULL, end_seal = NULL;"
      "UPDATE notes SET link = NULL, seal = NULL;"
      "UPDATE attempts SET link = NULL, seal = NULL, samples_sha256 = NULL;");
  SealWriter(db).seal_existing_rows();
}

}  // namespace palpate::data::testing
