// Withdrawal: nothing of a participant stays in the database, its log or its backups.

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

constexpr const char* kTheirs = "(SELECT id FROM participants WHERE code = ?)";

std::int64_t count(SQLite::Database& db, const std::string& sql, const std::string& code) {
  SQLite::Statement find(db, "SELECT count(*) FROM " + sql);
  Binder(find) << code;
  find.executeStep();
  return find.getColumn(0).getInt64();
}

std::string attempts_of_theirs() {
  return std::string(
             "(SELECT a.id FROM attempts a JOIN sessions s ON s.id = a.session_id WHERE "
             "s.participant_id IN ") +
         kTheirs + ")";
}

std::string sessions_of_theirs() {
  return std::string("(SELECT id FROM sessions WHERE participant_id IN ") + kTheirs + ")";
}

void delete_rows(SQLite::Database& db, const std::string& code) {
  const std::string sessions = sessions_of_theirs();
  for (const std::string& what :
       {"samples WHERE attempt_id IN " + attempts_of_theirs(),
        "attempts WHERE session_id IN " + sessions,
        "notes WHERE run_id IN (SELECT id FROM runs WHERE session_id IN " + sessions + ")",
        "runs WHERE session_id IN " + sessions,
        std::string("sessions WHERE participant_id IN ") + kTheirs,
        std::string("export_participants WHERE participant_id IN ") + kTheirs,
        std::string("renumberings WHERE participant_id IN ") + kTheirs,
        std::string("participants WHERE code = ?")}) {
    SQLite::Statement remove(db, "DELETE FROM " + what);
    Binder(remove) << code;
    remove.exec();
  }
}

/// The name of an export may say the code as well: it is crossed out, where that leaves other words
/// alone ("1" is in many a path).
void cross_out_in_paths(SQLite::Database& db, const std::string& code) {
  constexpr std::size_t kUnmistakable = 6;  // characters
  SQLite::Statement find(db, "SELECT id, path FROM exports WHERE instr(path, ?)");
  Binder(find) << code;
  std::vector<std::pair<std::int64_t, std::string>> named;
  while (find.executeStep()) {
    std::string path = find.getColumn(1).getString();
    if (code.size() < kUnmistakable && !mentions(path, code)) continue;
    for (std::size_t at = 0; (at = path.find(code)) != std::string::npos;) {
      path.replace(at, code.size(), "...");
    }
    named.emplace_back(find.getColumn(0).getInt64(), path);
  }
  SQLite::Statement rename(db, "UPDATE exports SET path = ? WHERE id = ?");
  for (const auto& [id, path] : named) {
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

enum class Backup { without, holds, unreadable };

Backup look_into(const std::string& backup, const std::string& code) {
  try {
    require_private_sqlite_files(backup);
    SQLite::Database db(backup, SQLite::OPEN_READONLY);
    return count(db, "participants WHERE code = ?", code) > 0 ? Backup::holds : Backup::without;
  } catch (const SQLite::Exception&) {
    return Backup::unreadable;
  } catch (const StoreRefused&) {
    return Backup::unreadable;
  }
}

}  // namespace

ParticipantSummary Store::participant_summary(const std::string& code) {
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    ParticipantSummary found;
    const std::string hash = Tombstones::read(db, impl_->path).find(code).hash;
    found.withdrawn_before = !hash.empty();
    found.protocols = count(db, "participants WHERE code = ?", code);
    found.sessions = count(db, std::string("sessions WHERE participant_id IN ") + kTheirs, code);
    found.trials = count(
        db, "attempts WHERE state = 'completed' AND session_id IN " + sessions_of_theirs(), code);
    found.cut_off = count(
        db, "attempts WHERE state <> 'completed' AND session_id IN " + sessions_of_theirs(), code);
    SQLite::Statement exports(
        db,
        "SELECT path, format, made_utc_ns FROM exports WHERE id IN (SELECT export_id FROM "
        "export_participants e JOIN participants p ON p.id = e.participant_id WHERE p.code = ? "
        "UNION "
        "SELECT export_id FROM tombstone_exports e JOIN tombstones t ON t.id = e.tombstone_id "
        "WHERE t.code_hash = ?) ORDER BY made_utc_ns, path");
    Binder(exports) << code << hash;
    found.exports = read_exports(exports);
    SQLite::Statement notes(
        db,
        "SELECT n.text FROM notes n JOIN runs r ON r.id = n.run_id JOIN sessions s ON s.id = "
        "r.session_id JOIN participants p ON p.id = s.participant_id WHERE p.code <> ?1 AND "
        "instr(n.text, ?1)");
    Binder(notes) << code;
    while (notes.executeStep()) {
      found.mentions += mentions(notes.getColumn(0).getString(), code) ? 1 : 0;
    }
    std::vector<std::string> known = backups_of(impl_->file);
    for (const ExportRecord& one : found.exports) {
      const std::string place = export_location(impl_->file, one.path);
      if (!place.empty()) known.push_back(place);
    }
    found.elsewhere = find_remaining_copies(impl_->file, code, known);
    return found;
  });
}

Withdrawal Store::forget(const std::string& code) {
  if (!is_participant_code(code)) impl_->refuse("'" + code + "' is no participant's code");
  impl_->require_writer();
  SQLite::Database& db = *impl_->db;
  const Tombstones tombstones = guarded(impl_->path, [&] {
    db.exec("PRAGMA secure_delete = ON");
    return Tombstones::read(db, impl_->path);
  });
  Tombstones::Tombstone tombstone = tombstones.find(code);
  const std::string before = tombstone.hash;
  if (before.empty() && participant_summary(code).protocols == 0) {
    impl_->refuse("there is no participant " + code + " here");
  }
  // One of before there were secrets gets one: the code is known once more.
  if (tombstone.secret.empty()) tombstone = tombstones.made_for(code);
  const std::string& hash = tombstone.hash;
  impl_->commit([&] {
    if (!before.empty() && before != hash) {
      SQLite::Statement again(db, "UPDATE tombstones SET code_hash = ? WHERE code_hash = ?");
      Binder(again) << hash << before;
      again.exec();
    }
    Tombstones::put(db, tombstone, false);
    SQLite::Statement exports(
        db,
        "INSERT OR IGNORE INTO tombstone_exports SELECT t.id, e.export_id FROM tombstones t, "
        "export_participants e JOIN participants p ON p.id = e.participant_id WHERE t.code_hash = "
        "? AND p.code = ?");
    Binder(exports) << hash << code;
    exports.exec();
    delete_rows(db, code);
    impl_->seals->reset_chains();
    cross_out_in_paths(db, code);
    return true;
  });
  Withdrawal done;
  impl_->purge_deleted_rows();
  for (const std::string& backup : backups_of(impl_->file)) {
    const Backup found = look_into(backup, code);
    if (found == Backup::without) continue;
    if (found == Backup::holds) {
      for (const char* end : {"", "-journal", "-wal", "-shm"}) ::unlink((backup + end).c_str());
    }
    (found == Backup::holds && !fs::exists(backup) ? done.backups_removed : done.backups_left)
        .push_back(backup);
  }
  remove_stale_temporaries_in(fs::path(impl_->file).parent_path());  // of exports that were killed
  if (done.backups_left.empty()) {
    impl_->commit([&] {
      SQLite::Statement cleared(db, "UPDATE tombstones SET cleared = 1 WHERE code_hash = ?");
      Binder(cleared) << hash;
      cleared.exec();
      return true;
    });
  }
  return done;
}

void Store::Impl::purge_deleted_rows() {
  const auto empty_the_log = [&] {
    SQLite::Statement checkpoint(*db, "PRAGMA wal_checkpoint(TRUNCATE)");
    checkpoint.executeStep();
    if (checkpoint.getColumn(0).getInt() != 0) {
      throw StoreError(path +
                       ": the rows are removed, but another program that reads the database keeps "
                       "them in its log; close it, then give the same command again");
    }
  };
  guarded(path, [&] {
    empty_the_log();
    // SQLite would put its working copy into the system's temporary folder.
    const std::string folder = fs::path(file).parent_path().string();
    SQLite::Statement place(*db, "SELECT 'PRAGMA temp_store_directory = ' || quote(?)");
    Binder(place) << folder;
    place.executeStep();
    db->exec(place.getColumn(0).getString());
    place.reset();
    db->exec("VACUUM");
    db->exec("PRAGMA temp_store_directory = ''");
    empty_the_log();
  });
}

}  // namespace palpate::data
