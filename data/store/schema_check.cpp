// A database that somebody else made may carry our name and other tables, or tables that do things.

#include <SQLiteCpp/Statement.h>

#include <algorithm>
#include <map>
#include <string>

#include "data/errors.h"
#include "data/store/schema.h"

namespace palpate::data {
namespace {

/// Without comments, every run of white space as one space; text in quotes as it is.
std::string plain_sql(const std::string& sql) {
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

/// Name -> plain SQL of every table and index that was made by a statement.
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
    objects[name] = plain_sql(find.getColumn(2).getString());
  }
  return objects;
}

std::map<std::string, std::string> our_objects(int version) {
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
  for (const auto& [name, sql] : our_objects(version)) {
    const auto object = found.find(name);
    if (object != found.end() && object->second == sql) continue;
    throw StoreRefused(path + ": '" + name + "' " +
                       (object == found.end() ? "is missing" : "is not as palpate makes it") +
                       " in schema version " + std::to_string(version) +
                       "; the file is damaged or was changed, restore a backup");
  }
}

}  // namespace palpate::data
