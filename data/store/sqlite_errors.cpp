#include "data/store/sqlite_errors.h"

#include <sqlite3.h>

#include "data/errors.h"

namespace palpate::data {

void raise_store_error(const std::string& path, const SQLite::Exception& error) {
  const std::string detail = std::string(" (SQLite: ") + error.what() + ")";
  switch (error.getErrorCode()) {
    case SQLITE_NOTADB:
      throw StoreRefused(path + ": is not a palpate database" + detail +
                         "; name another file, or restore it from a backup");
    case SQLITE_CORRUPT:
      throw StoreRefused(
          path + ": is damaged or truncated" + detail + "; keep a copy of it and of " + path +
          "-wal, then restore a backup or recover with: sqlite3 '" + path + "' .recover");
    case SQLITE_FULL:
      throw StoreError(path + ": the disk is full, this step was not saved" + detail +
                       "; free some space, then start again: the session resumes at this trial");
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
