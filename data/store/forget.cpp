// Withdrawal: removes every byte of a participant from the database, its -wal and its backups, and
// leaves a tombstone (tombstones.h). Order: one transaction deletes the rows (PRAGMA secure_delete
// overwrites them with zeros) and inserts the tombstone; then a checkpoint truncates the -wal, and
// VACUUM rebuilds the file; then backups are deleted; last, the tombstone is marked `cleared`.
// After a crash at any point the same call finishes the rest.

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "data/files/file_permissions.h"
#include "data/files/temporary_names.h"
#include "data/store/connection.h"
#include "data/store/remaining_copies.h"
#include "data/store/statement_values.h"
#include "data/store/tombstones.h"
#include "data/store/validation.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr const char* kParticipantIds = "(SELECT id FROM participants WHERE code = ?)";

std::int64_t count_rows(SQLite::Database& db, const std::string& sql, const std::string& code) {
  SQLite::Statement find(db, "SELECT count(*) FROM " + sql);
  Binder(find) << code;
  find.executeStep();
  return find.getColumn(0).getInt64();
}

std::string attempt_ids() {
  return std::string(
             "(SELECT a.id FROM attempts a JOIN sessions s ON s.id = a.session_id WHERE "
             "s.participant_id IN ") +
         kParticipantIds + ")";
}

std::string session_ids() {
  return std::string("(SELECT id FROM sessions WHERE participant_id IN ") + kParticipantIds + ")";
}

void delete_rows(SQLite::Database& db, const std::string& code) {
  const std::string sessions = session_ids();
  for (const std::string& what :
       {"samples WHERE attempt_id IN " + attempt_ids(), "attempts WHERE session_id IN " + sessions,
        "notes WHERE run_id IN (SELECT id FROM runs WHERE session_id IN " + sessions + ")",
        "page_answers WHERE run_id IN (SELECT id FROM runs WHERE session_id IN " + sessions + ")",
        "runs WHERE session_id IN " + sessions,
        std::string("sessions WHERE participant_id IN ") + kParticipantIds,
        std::string("export_participants WHERE participant_id IN ") + kParticipantIds,
        std::string("renumberings WHERE participant_id IN ") + kParticipantIds,
        std::string("participants WHERE code = ?")}) {
    SQLite::Statement remove(db, "DELETE FROM " + what);
    Binder(remove) << code;
    remove.exec();
  }
}

/// Paths of exports may contain the code, too: replaces it by "...", unless the code is short and
/// part of another word ("1" occurs in many paths).
void redact_export_paths(SQLite::Database& db, const std::string& code) {
  constexpr std::size_t kUnmistakable = 6;  // characters
  SQLite::Statement find(db, "SELECT id, path FROM exports WHERE instr(path, ?)");
  Binder(find) << code;
  std::vector<std::pair<std::int64_t, std::string>> redacted;
  while (find.executeStep()) {
    std::string path = find.getColumn(1).getString();
    if (code.size() < kUnmistakable && !mentions(path, code)) continue;
    for (std::size_t at = 0; (at = path.find(code)) != std::string::npos;) {
      path.replace(at, code.size(), "...");
    }
    redacted.emplace_back(find.getColumn(0).getInt64(), path);
  }
  SQLite::Statement rename(db, "UPDATE exports SET path = ? WHERE id = ?");
  for (const auto& [id, path] : redacted) {
    rename.reset();
    Binder(rename) << path + " (export " + std::to_string(id) + ")" << id;
    rename.exec();
  }
}

std::vector<ExportRecord> read_exports(SQLite::Statement& find) {
  std::vector<ExportRecord> all;
  while (find.executeStep()) {
    ExportRecord& one = all.emplace_back();
    RowReader(find) >> one.path >> one.format >> one.made_utc_ns;
  }
  return all;
}

/// Backups of migrations: FILE.v<N>[-<I>].backup.
std::vector<std::string> backups_of(const std::string& file) {
  const fs::path path(file);
  const std::string begin = path.filename().string() + ".v", end = ".backup";
  std::vector<std::string> all;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(end)) all.push_back(entry.path().string());
  }
  std::sort(all.begin(), all.end());
  return all;
}

enum class BackupContent { other_participants, participant, unreadable };

BackupContent inspect_backup(const std::string& backup, const std::string& code) {
  try {
    require_private_sqlite_files(backup);
    SQLite::Database db(backup, SQLite::OPEN_READONLY);
    return count_rows(db, "participants WHERE code = ?", code) > 0
               ? BackupContent::participant
               : BackupContent::other_participants;
  } catch (const SQLite::Exception&) {
    return BackupContent::unreadable;
  } catch (const StoreRefused&) {
    return BackupContent::unreadable;
  }
}

/// Deletes the backups that hold the participant.
Withdrawal remove_backups(const std::string& file, const std::string& code) {
  Withdrawal done;
  for (const std::string& backup : backups_of(file)) {
    const BackupContent content = inspect_backup(backup, code);
    if (content == BackupContent::other_participants) continue;
    if (content == BackupContent::participant) {
      for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
        ::unlink((backup + suffix).c_str());
      }
    }
    const bool removed = content == BackupContent::participant && !fs::exists(backup);
    (removed ? done.backups_removed : done.backups_left).push_back(backup);
  }
  return done;
}

/// Exports that hold the code, also those of before a withdrawal. \param hash of its tombstone, or
/// ""
std::vector<ExportRecord> exports_of(SQLite::Database& db, const std::string& code,
                                     const std::string& hash) {
  SQLite::Statement exports(
      db,
      "SELECT path, format, made_utc_ns FROM exports WHERE id IN (SELECT export_id FROM "
      "export_participants e JOIN participants p ON p.id = e.participant_id WHERE p.code = ? "
      "UNION "
      "SELECT export_id FROM tombstone_exports e JOIN tombstones t ON t.id = e.tombstone_id "
      "WHERE t.code_hash = ?) ORDER BY made_utc_ns, path");
  Binder(exports) << code << hash;
  return read_exports(exports);
}

/// The number of notes on other participants that mention the code.
std::int64_t notes_that_mention(SQLite::Database& db, const std::string& code) {
  SQLite::Statement notes(
      db,
      "SELECT n.text FROM notes n JOIN runs r ON r.id = n.run_id JOIN sessions s ON s.id = "
      "r.session_id JOIN participants p ON p.id = s.participant_id WHERE p.code <> ?1 AND "
      "instr(n.text, ?1)");
  Binder(notes) << code;
  std::int64_t found = 0;
  while (notes.executeStep()) found += mentions(notes.getColumn(0).getString(), code) ? 1 : 0;
  return found;
}

}  // namespace

ParticipantSummary Store::participant_summary(const std::string& code) {
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    ParticipantSummary found;
    const std::string hash = Tombstones::read(db, impl_->path).find(code).hash;
    found.withdrawn_before = !hash.empty();
    found.protocols = count_rows(db, "participants WHERE code = ?", code);
    found.sessions =
        count_rows(db, std::string("sessions WHERE participant_id IN ") + kParticipantIds, code);
    found.trials = count_rows(
        db, "attempts WHERE state = 'completed' AND session_id IN " + session_ids(), code);
    found.cut_off = count_rows(
        db, "attempts WHERE state <> 'completed' AND session_id IN " + session_ids(), code);
    found.exports = exports_of(db, code, hash);
    found.mentions = notes_that_mention(db, code);
    std::vector<std::string> known = backups_of(impl_->file);
    for (const ExportRecord& one : found.exports) {
      const std::string location = export_location(impl_->file, one.path);
      if (!location.empty()) known.push_back(location);
    }
    found.remaining_copies = find_remaining_copies(impl_->file, code, known);
    return found;
  });
}

void Store::Impl::replace_by_tombstone(const std::string& code,
                                       const Tombstones::Tombstone& tombstone,
                                       const std::string& earlier_hash) {
  if (!earlier_hash.empty() && earlier_hash != tombstone.hash) {
    SQLite::Statement rehash(*db, "UPDATE tombstones SET code_hash = ? WHERE code_hash = ?");
    Binder(rehash) << tombstone.hash << earlier_hash;
    rehash.exec();
  }
  Tombstones::put(*db, tombstone, false);
  SQLite::Statement exports(
      *db,
      "INSERT OR IGNORE INTO tombstone_exports SELECT t.id, e.export_id FROM tombstones t, "
      "export_participants e JOIN participants p ON p.id = e.participant_id WHERE t.code_hash = "
      "? AND p.code = ?");
  Binder(exports) << tombstone.hash << code;
  exports.exec();
  delete_rows(*db, code);
  seals->reset_chains();
  redact_export_paths(*db, code);
}

Withdrawal Store::forget(const std::string& code) {
  if (!is_participant_code(code)) impl_->refuse("'" + code + "' is not a participant code");
  impl_->require_writer();
  SQLite::Database& db = *impl_->db;
  const Tombstones tombstones = guarded(impl_->path, [&] {
    db.exec("PRAGMA secure_delete = ON");
    return Tombstones::read(db, impl_->path);
  });
  Tombstones::Tombstone tombstone = tombstones.find(code);
  const std::string earlier_hash = tombstone.hash;
  if (earlier_hash.empty() && participant_summary(code).protocols == 0) {
    impl_->refuse("there is no participant " + code + " here");
  }
  // A tombstone of schema version 2 has no secret: made again, now that the code is known.
  if (tombstone.secret.empty()) tombstone = tombstones.made_for(code);
  impl_->commit([&] {
    impl_->replace_by_tombstone(code, tombstone, earlier_hash);
    return true;
  });
  impl_->purge_deleted_rows();
  Withdrawal done = remove_backups(impl_->file, code);
  // Temporary files of exports that were killed may hold the participant.
  remove_stale_temporaries_in(fs::path(impl_->file).parent_path());
  if (done.backups_left.empty()) {
    impl_->commit([&] {
      SQLite::Statement cleared(db, "UPDATE tombstones SET cleared = 1 WHERE code_hash = ?");
      Binder(cleared) << tombstone.hash;
      cleared.exec();
      return true;
    });
  }
  return done;
}

void Store::Impl::purge_deleted_rows() {
  const auto truncate_wal = [&] {
    SQLite::Statement checkpoint(*db, "PRAGMA wal_checkpoint(TRUNCATE)");
    checkpoint.executeStep();
    if (checkpoint.getColumn(0).getInt() != 0) {
      throw StoreError(path +
                       ": the rows are removed, but the log still holds them while another program "
                       "reads the database; close it, then give the same command again");
    }
  };
  guarded(path, [&] {
    truncate_wal();
    // VACUUM writes a copy: beside the database, not into the system's temporary folder.
    const std::string folder = fs::path(file).parent_path().string();
    SQLite::Statement set_folder(*db, "SELECT 'PRAGMA temp_store_directory = ' || quote(?)");
    Binder(set_folder) << folder;
    set_folder.executeStep();
    db->exec(set_folder.getColumn(0).getString());
    set_folder.reset();
    db->exec("VACUUM");
    db->exec("PRAGMA temp_store_directory = ''");
    truncate_wal();
  });
}

}  // namespace palpate::data
