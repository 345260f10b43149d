#pragma once
// Internal to data/: is a file one of ours, and whole?

#include <SQLiteCpp/Database.h>

#include <string>

namespace palpate::data {

/// SQLite's name for a file that nobody writes to: no locks, no log.
std::string immutable_uri(const std::string& file);

/// Another program's file is left alone: this look takes no locks and writes nothing, where an
/// ordinary one could roll back or checkpoint it. \throws StoreRefused: it is not ours;
/// SQLite::Exception: it is no database.
void require_palpate_database(const std::string& file, const std::string& path);

/// SQLite fills a last page that is cut short with zeros. Beside a log that is right: the log has
/// the page. \throws SQLite::Exception.
void require_complete_pages(const std::string& file);

/// Cheap damage is found before a participant sits down. Not the samples: they may be gigabytes,
/// and carry their own checksums. \param attempts_later the CHECKs of attempts, which take a second
/// for every million, are left to the reader of each (for_each_attempt).
/// \throws SQLite::Exception, StoreRefused.
void quick_check(SQLite::Database& db, const std::string& path, bool attempts_later = false);

}  // namespace palpate::data
