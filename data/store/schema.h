#pragma once
// Internal to data/: which files are ours, how one is made and how an older one becomes a current
// one.

#include <SQLiteCpp/Database.h>

#include <span>
#include <string>

namespace palpate::data {

inline constexpr int kSchemaVersion = 3;
inline constexpr int kApplicationId = 0x504C5054;  ///< "PLPT", in every file of ours

inline constexpr int kPageSize = 4096;  ///< bytes; a file of ours is whole pages

/// schema.sql (version 1), withdrawal.sql and provenance.sql (what versions 2 and 3 add) as they
/// were when the program was built.
const char* schema_sql();
const char* withdrawal_sql();
const char* provenance_sql();

/// Turns version `from` into `from + 1`.
struct Migration {
  int from;
  const char* sql;
  void (*fill)(SQLite::Database&) = nullptr;  ///< what SQL cannot do, after it
};

/// The migrations to kSchemaVersion, in order.
std::span<const Migration> migrations();

/// Makes the database whole or not at all: built in a private draft folder beside `path`, synced,
/// renamed where there is nothing. 0600.
/// The caller holds the writer's lock and has seen that there is no file. \throws StoreError.
void create_database(const std::string& path);

/// \throws StoreRefused: it is not ours; SQLite::Exception: it is no database at all.
void require_application_id(SQLite::Database& db, const std::string& path);

/// The version of an open database. \throws StoreRefused: it is not ours, or newer than `newest`.
int checked_version(SQLite::Database& db, const std::string& path, int newest = kSchemaVersion);

/// Every table and index of ours in the file is the one that we would make, so that its CHECKs hold
/// where quick_check says so, and nothing runs by itself (triggers). Others' tables are left alone.
/// \throws StoreRefused.
void verify_schema(SQLite::Database& db, const std::string& path, int version);

/// Brings a database of version `from` to `to`: copies it to a new `path`.v<from>.backup (0600),
/// then runs every step in one transaction. \return the path of the copy. \throws StoreError; the
/// database is then as it was.
std::string migrate(SQLite::Database& db, const std::string& path, int from, int to,
                    std::span<const Migration> steps);

}  // namespace palpate::data
