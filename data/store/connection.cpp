#include "data/store/connection.h"

#include <SQLiteCpp/Statement.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

#include "data/errors.h"
#include "data/store/statement.h"

namespace palpate::data {

void Store::Impl::refuse(const std::string& why) const { throw StoreRefused(path + ": " + why); }

void Store::Impl::require_writer() const {
  if (!writes()) refuse("was opened for reading only");
}

void Store::Impl::require_running(const Run& run) {
  SQLite::Statement find(
      *db, "SELECT 1 FROM runs WHERE id = ? AND session_id = ? AND end_reason = 'running'");
  Binder(find) << run.id << run.session_id;
  if (!find.executeStep()) {
    refuse("this run of session " + std::to_string(run.session) + " has ended");
  }
}

void Store::Impl::require_files_in_place() {
  repair_wal_index();
  const FileIdentity wal = identity_of(file + "-wal");
  if (wal_identity == FileIdentity{}) wal_identity = wal;  // created by the first write
  if (identity_of(file) != identity || wal != wal_identity || wal == FileIdentity{}) {
    throw StoreError(path +
                     ": the file or its -wal was moved, replaced or deleted while in use; this "
                     "step is not safely stored. Put both back where they were before continuing, "
                     "or restore a backup");
  }
}

void Store::Impl::repair_wal_index() {
  if (!writes()) return;
  const std::string index = file + "-shm";
  struct stat found {};
  if (::lstat(index.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return;
  const FileIdentity now{found.st_dev, found.st_ino};
  if (now != index_identity || found.st_size >= index_size) {
    index_identity = now;
    index_size = found.st_size;
    return;
  }
  // Truncate by name: closing a descriptor would release SQLite's POSIX locks. Truncate to 0 first,
  // so that the file is zero-filled and SQLite recovers all of it from the -wal.
  if (::truncate(index.c_str(), 0) != 0 || ::truncate(index.c_str(), index_size) != 0) {
    throw StoreError(path + ": its WAL index " + index +
                     " was truncated while in use and cannot be restored; this step was not saved");
  }
}

Store::Impl::~Impl() {
  try {
    repair_wal_index();          // closing the database accesses it
  } catch (const StoreError&) {  // every acknowledged commit is in the -wal
    return;
  }
}

}  // namespace palpate::data
