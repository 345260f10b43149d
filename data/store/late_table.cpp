#include "data/store/late_table.h"

#include <SQLiteCpp/Statement.h>

#include "data/errors.h"

namespace palpate::data {

bool LateTable::is_in(SQLite::Database& db, const std::string& path) const {
  SQLite::Statement find(db, "SELECT sql FROM sqlite_schema WHERE name = ?");
  find.bind(1, name);
  if (!find.executeStep()) return false;
  if (find.getColumn(0).getString() != sql)
    throw StoreRefused(path + ": '" + name +
                       "' is not defined as palpate defines it; the file is damaged or was "
                       "changed, restore a backup");
  return true;
}

}  // namespace palpate::data
