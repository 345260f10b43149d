// Verifies the schema of a file: even with palpate's application_id it may have other table
// definitions, or triggers that run on writing.
#include "data/store/schema.h"

#include <SQLiteCpp/Backup.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <string>
#include <system_error>
#include <vector>

#include "data/errors.h"
#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/store/seals.h"
#include "data/store/store_error.h"
#include "data/store/sweep_file.h"

namespace palpate::data {
namespace {

/// SQL without comments and with single spaces; quoted text unchanged.
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
      throw StoreRefused(
          path + ": has a trigger, '" + name +
          "', unlike every database that palpate creates; remove it with: sqlite3 FILE 'DROP "
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

void set_version(SQLite::Database& db, int version) {
  db.exec("PRAGMA user_version = " + std::to_string(version));
}

/// Creates it in a private folder, where no other user can put files beside it.
void make_private_file(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    throw StoreError(file + ": cannot be created: " + std::generic_category().message(errno) +
                     "; check that the folder exists and that you may write there");
  }
  ::close(descriptor);
}

/// Moves all of the log into the file. \throws SQLite::Exception: the disk is full
void checkpoint(SQLite::Database& db) {
  SQLite::Statement all(db, "PRAGMA wal_checkpoint(TRUNCATE)");
  all.executeStep();
}

/// \return the path of the backup
std::string back_up(SQLite::Database& db, const std::string& path, int version) {
  const std::string stem = path + ".v" + std::to_string(version);
  const AtomicFolder folder(stem);
  const std::string temporary = folder / "backup.db";
  make_private_file(temporary);
  std::string copy = stem + ".backup";
  guarded(copy, [&] {
    SQLite::Database target(temporary, SQLite::OPEN_READWRITE);
    if (SQLite::Backup(target, db).executeStep() != SQLITE_DONE) {
      throw StoreError(path + ": cannot be copied to " + copy +
                       " before it is migrated: another program has locked it");
    }
  });
  for (int i = 2; !rename_if_absent(temporary, copy); ++i) {
    copy = stem + "-" + std::to_string(i) + ".backup";
  }
  return copy;
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

std::span<const Migration> migrations() {
  static const std::vector<Migration> steps = [] {
    std::vector<Migration> made;
    for (const char* sql : migrations_sql())
      made.push_back({static_cast<int>(made.size()) + 1, sql});
    made.at(1).fill = [](SQLite::Database& db) { SealWriter(db).seal_existing_rows(); };
    return made;
  }();
  return steps;
}

void create_database(const std::string& path) {
  const AtomicFolder folder(path);
  const std::string temporary = folder / "new.db";
  make_private_file(temporary);
  guarded(path, [&] {
    SQLite::Database db(temporary, SQLite::OPEN_READWRITE);
    db.exec("PRAGMA page_size = " + std::to_string(kPageSize));
    db.exec("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL");
    SQLite::Transaction transaction(db);
    db.exec(schema_sql());
    for (const Migration& step : migrations()) db.exec(step.sql);
    db.exec("PRAGMA application_id = " + std::to_string(kApplicationId));
    set_version(db, kSchemaVersion);
    transaction.commit();
    checkpoint(db);  // closing does so too, but cannot report a full disk
  });
  if (!rename_if_absent(temporary, path)) {
    throw StoreRefused(path + ": another program created it at the same moment; start again");
  }
}

void require_application_id(SQLite::Database& db, const std::string& path) {
  if (db.execAndGet("PRAGMA application_id").getInt() == kApplicationId) return;
  if (db.execAndGet("PRAGMA application_id").getInt() == kSweepApplicationId) {
    throw StoreRefused(
        path +
        ": is the file of a sweep, not a study's database; read it with 'palpate analyze --sweep', "
        "'export' or 'merge', resume it with 'palpate sweep'");
  }
  throw StoreRefused(path + ": is not a palpate database but another program's; name another file");
}

int checked_version(SQLite::Database& db, const std::string& path, int newest) {
  return guarded(path, [&] {
    require_application_id(db, path);
    const int version = db.execAndGet("PRAGMA user_version").getInt();
    if (version > newest || version < 1) {
      throw StoreRefused(path + ": has schema version " + std::to_string(version) +
                         "; this version of palpate reads 1 to " + std::to_string(newest) +
                         "; use the version that wrote it or a newer one");
    }
    return version;
  });
}

std::string migrate(SQLite::Database& db, const std::string& path, int from, int to,
                    std::span<const Migration> steps) {
  std::string copy = back_up(db, path, from);
  guarded(path, [&] {
    // A step may rebuild tables that others refer to; check foreign keys once, at the end.
    db.exec("PRAGMA foreign_keys = OFF");
    SQLite::Transaction transaction(db, SQLite::TransactionBehavior::IMMEDIATE);
    int version = from;
    for (const auto& step : steps) {
      if (step.from != version || version >= to) continue;
      db.exec(step.sql);
      if (step.fill != nullptr) step.fill(db);
      ++version;
    }
    if (version != to) {
      throw StoreError(path + ": no migration from schema version " + std::to_string(version) +
                       " to " + std::to_string(to));
    }
    if (SQLite::Statement(db, "PRAGMA foreign_key_check").executeStep()) {
      throw StoreError(path +
                       ": the migration would break references between rows; it stays at version " +
                       std::to_string(from) + "; its backup is " + copy);
    }
    set_version(db, version);
    transaction.commit();
  });
  return copy;
}

}  // namespace palpate::data
