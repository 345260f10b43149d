#include "data/store/station_database.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <filesystem>

#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/store/attempts.h"
#include "data/store/open.h"
#include "data/store/protocol_rows.h"
#include "data/store/schema.h"
#include "data/store/store.h"
#include "data/store/store_error.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

/// A message about the copy, rewritten to name the file that the user gave.
std::string renamed(std::string message, const std::string& copy, const std::string& path) {
  for (std::size_t at = 0; (at = message.find(copy, at)) != std::string::npos; at += path.size()) {
    message.replace(at, copy.size(), path);
  }
  return message;
}

/// Copying on a full disk may fail with an unrelated error.
std::string cause_of(const std::error_code& error, const std::string& copy) {
  constexpr std::uintmax_t kFull = 65'536;  // bytes
  std::error_code unknown;
  const fs::space_info disk = fs::space(fs::path(copy).parent_path(), unknown);
  return !unknown && disk.available < kFull ? "the disk is full" : write_fault(error.value());
}

}  // namespace

StationDatabase::FileState StationDatabase::state_of_file(const std::string& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) return {};
  return {{found.st_dev, found.st_ino},
          found.st_size,
          found.st_mtim.tv_sec * 1'000'000'000 + found.st_mtim.tv_nsec};
}

StationDatabase::StationDatabase(const std::string& path, const std::string& scratch)
    : path_(path) {
  std::error_code error;
  file_ = fs::weakly_canonical(fs::absolute(path, error), error).string();
  if (path.empty() || error || !fs::is_regular_file(file_, error)) {
    throw StoreRefused(path + ": there is no such file (or its folder may not be read)");
  }
  if (fs::file_size(file_, error) == 0 || error) {
    throw StoreRefused(path + ": is empty; a palpate database is never empty");
  }
  try {
    lock_.emplace(file_);
  } catch (const StoreRefused&) {
    throw;  // another process writes to it
  } catch (const StoreError&) {
    lock_.reset();  // no write permission for its folder, so this user has no writer either
  }
  opened_ = state_of_file(file_);
  guarded(path, [&] {
    require_private_sqlite_files(file_);
    require_palpate_database(file_, path);
    require_complete_pages(file_);
    if (!is_current()) take_copy(scratch);
    const std::string& read = db_ ? file_ : scratch;
    if (!db_) db_.emplace(immutable_uri(scratch), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
    db_->exec("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON");
    verify_schema(*db_, path, checked_version(*db_, path));
    if (read == file_) quick_check(*db_, path);
    verify_protocol_checksums(*db_, path, kSchemaVersion);
    // Also decode the samples of a copy: its rows were sealed during migration.
    AttemptFilter all;
    all.samples = read == file_ ? SampleReading::verify : SampleReading::unpack;
    read_attempts(*db_, path_, kSchemaVersion, all, [](const StoredTrial&) {});
  });
}

bool StationDatabase::is_current() {
  std::error_code error;
  const auto log = fs::file_size(file_ + "-wal", error);
  if (!error && log > 0) return false;
  db_.emplace(immutable_uri(file_), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  db_->exec("PRAGMA trusted_schema = OFF");
  const int version = checked_version(*db_, path_);
  verify_schema(*db_, path_, version);
  const bool running =
      db_->execAndGet("SELECT EXISTS (SELECT 1 FROM runs WHERE end_reason = 'running')").getInt() !=
      0;
  if (version == kSchemaVersion && !running) return true;
  db_.reset();
  return false;
}

void StationDatabase::take_copy(const std::string& scratch) {
  for (const char* end : {"", "-wal"}) {
    std::error_code error;
    if (!fs::exists(file_ + end)) continue;
    fs::copy_file(file_ + end, scratch + end, error);
    if (error) {
      throw StoreError(path_ + ": cannot be copied to " + scratch + ": " +
                       cause_of(error, scratch) +
                       "; check the permissions and the free space there");
    }
    fs::permissions(scratch + end, fs::perms::owner_read | fs::perms::owner_write, error);
  }
  try {
    Store::open(scratch, Store::Mode::write_or_create);
  } catch (const StoreRefused& error) {
    throw StoreRefused(renamed(error.what(), scratch, path_));
  } catch (const StoreError& error) {
    throw StoreError(path_ + ": cannot be read through a copy: " + error.what());
  }
  // The copy is read without its log; closing has merged the log unless the disk is full.
  std::error_code none;
  if (const auto left = fs::file_size(scratch + "-wal", none); !none && left > 0) {
    throw StoreError(path_ + ": cannot be copied to " + scratch +
                     ": the disk is full; free some space there");
  }
}

void StationDatabase::require_unchanged() const {
  if (state_of_file(file_) == opened_) return;
  throw StoreError(path_ +
                   ": was changed while it was read; start again when the other program has ended");
}

}  // namespace palpate::data
