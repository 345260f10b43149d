#include "data/store/store_error.h"

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/statvfs.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "data/errors.h"

namespace palpate::data {
namespace {

/// SQLite reports a full disk when it writes a page, but not when it maps memory.
bool disk_is_full(const std::string& path) {
  constexpr unsigned long kMappedAtOnce = 32'768;  // bytes, of a -shm
  const std::string folder = std::filesystem::path(path).parent_path().string();
  struct statvfs disk {};
  return ::statvfs(folder.empty() ? "." : folder.c_str(), &disk) == 0 &&
         disk.f_bavail * disk.f_frsize < 2 * kMappedAtOnce;
}

/// The limit on the size of a file, in bytes, where there is one: beyond it writing fails.
std::optional<std::uint64_t> file_size_limit() {
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::nullopt;
  return limit.rlim_cur;
}

/// "the disk is full", or the limit that reads like it
std::string full_disk(const std::string& path) {
  const auto limit = file_size_limit();
  if (!limit || disk_is_full(path)) return "the disk is full";
  return "the disk is full, or the limit on the size of a file is reached (ulimit -f: " +
         std::to_string(*limit) + " bytes)";
}

/// \return the primary result code
int cause_of(const std::string& path, const SQLite::Exception& error) {
  const int code = error.getErrorCode() & 0xff;
  const bool may_be_full = code == SQLITE_IOERR || code == SQLITE_CANTOPEN;
  const bool limited = code == SQLITE_IOERR && file_size_limit();
  return limited || (may_be_full && disk_is_full(path)) ? SQLITE_FULL : code;
}

}  // namespace

void raise_store_error(const std::string& path, const SQLite::Exception& error) {
  const std::string detail = std::string(" (SQLite: ") + error.what() + ")";
  switch (cause_of(path, error)) {
    case SQLITE_NOTADB:
      throw StoreRefused(path + ": is not a palpate database" + detail +
                         "; name another file, or restore it from a backup");
    case SQLITE_CORRUPT:
      throw StoreRefused(
          path + ": is damaged or truncated" + detail + "; keep a copy of it and of " + path +
          "-wal, then restore a backup or recover with: sqlite3 '" + path + "' .recover");
    case SQLITE_FULL:
      throw StoreError(path + ": " + full_disk(path) + ", this step was not saved" + detail +
                       "; free some space or raise the limit, then give the same command again");
    case SQLITE_NOMEM:
      throw StoreError(path + ": out of memory, this step was not saved" + detail +
                       "; close other programs or raise the limit (ulimit -v), then give the same "
                       "command again");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw StoreError(path + ": another program has locked it, this step was not saved" + detail +
                       "; close that program, then start again");
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      throw StoreError(path + ": cannot be written" + detail +
                       "; check the permissions of the file and its folder");
    case SQLITE_CANTOPEN:
      throw StoreError(path + ": cannot be opened" + detail +
                       "; check that the file is there and that you may read and write it and its "
                       "folder");
    case SQLITE_IOERR:
      throw StoreError(path + ": the disk reports an error, this step was not saved" + detail +
                       "; check the disk and its free space before continuing");
    default:
      throw StoreError(path + ": this step was not saved" + detail);
  }
}

}  // namespace palpate::data
