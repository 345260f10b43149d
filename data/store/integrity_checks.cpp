#include "data/store/integrity_checks.h"

#include <SQLiteCpp/Statement.h>
#include <sqlite3.h>

#include <filesystem>

#include "data/errors.h"
#include "data/store/schema.h"

namespace palpate::data {

void quick_check(SQLite::Database& db, const std::string& path, bool attempts_later) {
  for (const char* table :
       {"protocols", "participants", "sessions", "runs", "notes", "attempts", "exports",
        "export_participants", "tombstones", "tombstone_exports", "files", "protocol_files",
        "renumberings", "tombstone_secrets", "page_answers"}) {
    if (!db.tableExists(table)) continue;  // of a later schema version
    const bool skip_constraints = attempts_later && std::string_view(table) == "attempts";
    db.exec(skip_constraints ? "PRAGMA ignore_check_constraints = ON"
                             : "PRAGMA ignore_check_constraints = OFF");
    SQLite::Statement check(db, std::string("PRAGMA quick_check(") + table + ")");
    if (!check.executeStep()) continue;
    const std::string found = check.getColumn(0).getString();
    if (found != "ok") throw SQLite::Exception(table + (": " + found), SQLITE_CORRUPT);
  }
  db.exec("PRAGMA ignore_check_constraints = OFF");
  if (SQLite::Statement(db, "PRAGMA foreign_key_check").executeStep()) {
    throw StoreRefused(path +
                       ": is damaged: rows refer to rows that are missing; restore a backup");
  }
  if (!db.tableExists("attempts") || !db.tableExists("runs")) return;
  SQLite::Statement strays(db,
                           "SELECT r.session_id <> a.session_id FROM attempts a JOIN runs r ON "
                           "r.id = a.run_id WHERE r.session_id <> a.session_id OR a.state NOT IN "
                           "('running', 'completed', 'cut_off') LIMIT 1");
  if (strays.executeStep()) {
    throw StoreRefused(path + ": is damaged: an attempt is " +
                       (strays.getColumn(0).getInt() != 0
                            ? "of a run of another session"
                            : "neither running nor completed nor cut off") +
                       "; restore a backup");
  }
}

std::string immutable_uri(const std::string& file) {
  std::string uri = "file:";
  for (const char c : file) {
    if (c == '?' || c == '#' || c == '%') {
      constexpr const char* kDigits = "0123456789ABCDEF";
      uri += {'%', kDigits[c >> 4], kDigits[c & 15]};
    } else {
      uri += c;
    }
  }
  return uri + "?immutable=1";
}

void require_palpate_database(const std::string& file, const std::string& path) {
  SQLite::Database probe(immutable_uri(file), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  try {
    require_application_id(probe, path);
  } catch (const SQLite::Exception& error) {
    // Beside a writer, the size in the header may exceed the file: left to the checks after
    // opening.
    if (error.getErrorCode() != SQLITE_CORRUPT) throw;
  }
}

void require_complete_pages(const std::string& file) {
  std::error_code error;
  const auto log = std::filesystem::file_size(file + "-wal", error);
  if (!error && log > 0) return;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size % kPageSize != 0) {
    throw SQLite::Exception(
        "it has " + std::to_string(size) + " bytes, which is not a whole number of pages",
        SQLITE_CORRUPT);
  }
}

}  // namespace palpate::data
