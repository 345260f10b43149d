#pragma once

#include <SQLiteCpp/Database.h>

#include <string>

#include "data/store/schema.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data::testing {

/// A database of the first version, with two trials.
inline void make_version_1(const std::string& path) {
  SQLite::Database db(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  db.exec("PRAGMA page_size = 4096; PRAGMA journal_mode = WAL");
  db.exec(contents_of(PALPATE_SOURCE_DIR "/tests/data/store/schema_v1.sql"));
  db.exec("PRAGMA application_id = " + std::to_string(kApplicationId) +
          "; PRAGMA user_version = 1");
  db.exec(
      "INSERT INTO protocols VALUES (1, '" + a_protocol().sha256 + "', 'ho2000', '" +
      a_protocol().text +
      "');"
      "INSERT INTO participants VALUES (1, 1, 'P1', 1, 0, NULL);"
      "INSERT INTO sessions VALUES (1, 1, 1, '');"
      "INSERT INTO runs VALUES (1, 1, 5, 5, '0.1.0', '', 'falcon', '', '', NULL, '', NULL, 'left', "
      "'done', 9);");
  for (const char* trial : {"1", "2"}) {
    db.exec(std::string("INSERT INTO attempts VALUES (") + trial + ", 1, 1, " + trial +
            ", 1, 1, 'ray', 'cube', 0, 1, 0, 0, 0, 6, 'completed', NULL, 'cube', 1, 0, 1.5, 0.5, "
            "7, 8, 0, 0, 0, 0, 0, 0, 1500, 0, 1000000, 0, 0, 2.5)");
  }
}

}  // namespace palpate::data::testing
