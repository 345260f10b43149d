#pragma once
// The schema of the database and its versions: creates a database, and migrates one of an earlier
// version.

#include <SQLiteCpp/Database.h>

#include <span>
#include <string>

namespace palpate::data {

inline constexpr int kSchemaVersion = 5;
inline constexpr int kApplicationId = 0x504C5054;  ///< "PLPT", PRAGMA application_id

inline constexpr int kPageSize = 4096;  ///< bytes

/// schema.sql (version 1) and the changes of versions 2, 3, ... (data/CMakeLists.txt lists their
/// files), embedded when the program was built.
const char* schema_sql();
std::span<const char* const> migrations_sql();

/// Turns version `from` into `from + 1`.
struct Migration {
  int from;
  const char* sql;
  void (*fill)(SQLite::Database&) = nullptr;  ///< after the SQL, for changes beyond SQL
};

/// The migrations to kSchemaVersion, in order.
std::span<const Migration> migrations();

/// Creates the database atomically: builds it in a temporary folder beside `path`, syncs it, and
/// renames it unless `path` exists by then. Mode 0600. The caller holds the WriterLock.
/// \throws StoreError.
void create_database(const std::string& path);

/// \throws StoreRefused: another program's database; SQLite::Exception: not a database.
void require_application_id(SQLite::Database& db, const std::string& path);

/// The schema version of an open database. \throws StoreRefused: another program's database, or a
/// version above `newest`.
int checked_version(SQLite::Database& db, const std::string& path, int newest = kSchemaVersion);

/// Verifies that every table and index of the schema version is defined as palpate defines it, so
/// that quick_check verifies the CHECK constraints that the program relies on, and that there are
/// no triggers. Additional tables are allowed. \throws StoreRefused.
void verify_schema(SQLite::Database& db, const std::string& path, int version);

/// Migrates a database of version `from` to `to`: backs it up to a new `path`.v<from>.backup
/// (0600), then runs all steps in one transaction. \return the path of the backup. \throws
/// StoreError; the database is then unchanged.
std::string migrate(SQLite::Database& db, const std::string& path, int from, int to,
                    std::span<const Migration> steps);

}  // namespace palpate::data
