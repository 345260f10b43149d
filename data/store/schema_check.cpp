// Verifies the schema of a file: one that carries palpate's application_id may still have other
// table definitions, or triggers that would run when it is written to.

#include <SQLiteCpp/Statement.h>

#include <algorithm>
#include <map>
#include <string>

#include "data/errors.h"
#include "data/store/schema.h"

namespace palpate::data {
namespace {

/// SQL without comments, every run of white space as one space; text in quotes unchanged.
std::string normalized_sql(const std::string& sql) {
  std::string plain;
  bool quoted = false;
  for (std::size_t i = 0; i < sql.size(); ++i) {
    if (!quoted && sql.compare(i, 2, "--") == 0) i = std::min(sql.find('\n', i), sql.size() - 1);
    const char c = sql[i];
    if (c == '\'') quoted = !quoted;
    const bool space = !quoted && (c == ' ' || c == '\n' || c == '\r' || c == '\t');
    if (!space) {
      plain += c;
    } else if (!plain.empty() && plain.back() != ' ') {
      plain += ' ';
    }
  }
  return plain;
}

/// Name -> normalized SQL of every table and index that a statement created.
std::map<std::string, std::string> objects_of(SQLite::Database& db, const std::string& path) {
  std::map<std::string, std::string> objects;
  SQLite::Statement find(db, "SELECT type, name, sql FROM sqlite_schema WHERE sql IS NOT NULL");
  while (find.executeStep()) {
    const std::string type = find.getColumn(0).getString(), name = find.getColumn(1).getString();
    if (type == "trigger") {
      throw StoreRefused(path + ": has a trigger, '" + name +
                         "', which no palpate database has; remove it with: sqlite3 FILE 'DROP "
                         "TRIGGER ...', or restore a backup");
    }
    objects[name] = normalized_sql(find.getColumn(2).getString());
  }
  return objects;
}

std::map<std::string, std::string> expected_objects(int version) {
  SQLite::Database db(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  db.exec(schema_sql());
  int made = 1;
  for (const auto& step : migrations()) {
    if (made++ < version) db.exec(step.sql);
  }
  return objects_of(db, "");
}

}  // namespace

void verify_schema(SQLite::Database& db, const std::string& path, int version) {
  const auto found = objects_of(db, path);
  for (const auto& [name, sql] : expected_objects(version)) {
    const auto object = found.find(name);
    if (object != found.end() && object->second == sql) continue;
    throw StoreRefused(
        path + ": '" + name + "' " +
        (object == found.end() ? "is missing" : "is not defined as palpate defines it") +
        " in schema version " + std::to_string(version) +
        "; the file is damaged or was changed, restore a backup");
  }
}

}  // namespace palpate::data
