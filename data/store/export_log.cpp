#include "data/store/export_log.h"

#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <sstream>
#include <utility>

#include "data/files/file_permissions.h"
#include "data/store/schema.h"
#include "data/store/statement.h"
#include "data/store/store.h"
#include "data/store/store_error.h"
#include "data/store/writer_lock.h"

namespace palpate::data {
namespace {

constexpr int kBusyMs = 5000;
constexpr const char* kElsewhere = " (elsewhere, ";

std::string short_hash(const std::string& place) {  // FNV-1a
  std::uint32_t hash = 2166136261U;
  for (const char c : place) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  std::ostringstream text;
  text << std::hex << std::setfill('0') << std::setw(8) << hash;
  return text.str();
}

/// How `path` is recorded: relative to the folder of the database or, outside of it, as the file
/// name with a hash of the path, "trials.csv (elsewhere, 1f3c9a02)". So a database that is shared
/// does not reveal the folders of a computer.
std::string recorded_path(const std::string& database, const std::string& path) {
  namespace fs = std::filesystem;
  fs::path place = fs::weakly_canonical(fs::absolute(path));
  if (!place.has_filename()) place = place.parent_path();
  const fs::path folder = fs::weakly_canonical(fs::absolute(database)).parent_path();
  const fs::path within = place.lexically_relative(folder);
  if (!within.empty() && *within.begin() != "..") return within.string();
  return place.filename().string() + kElsewhere + short_hash(place.string()) + ")";
}

/// Earlier versions of palpate recorded absolute paths.
void shorten_paths(SQLite::Database& db, const std::string& file) {
  SQLite::Statement find(db, "SELECT id, path FROM exports WHERE substr(path, 1, 1) = '/'");
  std::vector<std::pair<std::int64_t, std::string>> whole;
  while (find.executeStep()) {
    whole.emplace_back(find.getColumn(0).getInt64(), find.getColumn(1).getString());
  }
  SQLite::Statement rename(db, "UPDATE OR IGNORE exports SET path = ? WHERE id = ?");
  for (const auto& [id, path] : whole) {
    rename.reset();
    Binder(rename) << recorded_path(file, path) << id;
    rename.exec();
  }
}

/// Opens the database for writing, with the current schema.
void open_current(std::optional<SQLite::Database>& db, const std::string& file,
                  const std::string& database) {
  require_private_sqlite_files(file);
  try {
    require_one_name(file, database);
  } catch (const StoreRefused& error) {
    throw StoreError(error.what());  // reading may go on: the export is made without a record
  }
  db.emplace(file, SQLite::OPEN_READWRITE, kBusyMs);
  if (checked_version(*db, database) < kSchemaVersion) {
    db.reset();
    Store::open(database, Store::Mode::write_or_create);  // migrates
    db.emplace(file, SQLite::OPEN_READWRITE, kBusyMs);
  }
  require_private_sqlite_files(file);
  db->exec("PRAGMA trusted_schema = OFF; PRAGMA synchronous = FULL; PRAGMA secure_delete = ON");
}

void delete_export(SQLite::Database& db, const std::string& path) {
  for (const char* sql :
       {"DELETE FROM export_participants WHERE export_id = (SELECT id FROM exports WHERE path = ?)",
        "DELETE FROM tombstone_exports WHERE export_id = (SELECT id FROM exports WHERE path = ?)",
        "DELETE FROM exports WHERE path = ?"}) {
    SQLite::Statement remove(db, sql);
    Binder(remove) << path;
    remove.exec();
  }
}

void insert_participants(SQLite::Database& db, const std::string& database, std::int64_t export_id,
                         const std::vector<std::int64_t>& participants) {
  SQLite::Statement add(
      db, "INSERT INTO export_participants SELECT ?, id FROM participants WHERE id = ?");
  for (const std::int64_t participant : participants) {
    add.reset();
    Binder(add) << export_id << participant;
    if (add.exec() == 1) continue;
    throw StoreRefused(database +
                       ": a participant was withdrawn while the export was made; nothing was "
                       "exported, start it again");
  }
}

}  // namespace

std::string export_location(const std::string& database, const std::string& recorded) {
  namespace fs = std::filesystem;
  if (recorded.find(kElsewhere) != std::string::npos) return "";
  return (fs::weakly_canonical(fs::absolute(database)).parent_path() / recorded).string();
}

void log_export(const std::string& database, const ExportRecord& made,
                const std::vector<std::int64_t>& participants) {
  const std::string file = std::filesystem::weakly_canonical(database).string();
  const std::string path = recorded_path(file, made.path);
  guarded(database, [&] {
    std::optional<SQLite::Database> db;
    open_current(db, file, database);
    SQLite::Transaction transaction(*db, SQLite::TransactionBehavior::IMMEDIATE);
    shorten_paths(*db, file);
    delete_export(*db, path);
    SQLite::Statement add(*db, "INSERT INTO exports (path, format, made_utc_ns) VALUES (?, ?, ?)");
    Binder(add) << path << made.format << made.made_utc_ns;
    add.exec();
    insert_participants(*db, database, db->getLastInsertRowid(), participants);
    transaction.commit();
  });
}

void ExportedParticipants::add(const Participant& participant) {
  if (!ids_.empty() && ids_.back() == participant.id) return;
  if (std::find(ids_.begin(), ids_.end(), participant.id) == ids_.end()) {
    ids_.push_back(participant.id);
  }
  any_simulated_ |= participant.simulated;
}

std::string ExportedParticipants::record(const std::string& database, const std::string& path,
                                         const std::string& format) const {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const ExportRecord made{path, format,
                          std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
  try {
    log_export(database, made, ids_);
  } catch (const StoreRefused&) {
    throw;
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

}  // namespace palpate::data
