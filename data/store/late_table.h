#pragma once
// Internal to data/store: a table that a database has from its first row on, outside the versions
// of the schema: a migration would rewrite every old database.

#include <SQLiteCpp/Database.h>

#include <string>

namespace palpate::data {

struct LateTable {
  const char* name;
  const char* sql;  ///< CREATE TABLE ...

  /// \param path  of the database, for messages \throws StoreRefused: another program's table of
  /// this name
  bool is_in(SQLite::Database& db, const std::string& path) const;
};

}  // namespace palpate::data
