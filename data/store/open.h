#pragma once
// Internal to data/store: whether a file is a palpate database, and undamaged. Store::open and
// StationDatabase call these before they read anything else.

#include <SQLiteCpp/Database.h>

#include <string>

namespace palpate::data {

/// The URI that opens a file with immutable=1 (https://www.sqlite.org/uri.html): no locks, no -wal.
/// Only for files that nobody writes to.
std::string immutable_uri(const std::string& file);

/// Takes no locks and writes nothing: opening another program's database must not roll it back or
/// checkpoint it. \throws StoreRefused: another program's; SQLite::Exception: not a database.
void require_palpate_database(const std::string& file, const std::string& path);

/// Refuses a file whose size is not a multiple of the page size: it is truncated, which SQLite does
/// not report. Not beside a non-empty -wal, which holds the missing page. \throws
/// SQLite::Exception.
void require_complete_pages(const std::string& file);

/// PRAGMA quick_check of every table but samples, and foreign_key_check, so that damage is found
/// before a session begins. Samples may be gigabytes and have checksums of their own.
/// \param attempts_later skips the CHECK constraints of attempts, which take a second per million;
/// read_attempts() verifies the values. \throws SQLite::Exception, StoreRefused.
void quick_check(SQLite::Database& db, const std::string& path, bool attempts_later = false);

}  // namespace palpate::data
