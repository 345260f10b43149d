#pragma once
// Internal to data/: what the store_*.cpp share.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Transaction.h>

#include <cstdint>
#include <optional>
#include <string>

#include "data/files/file_identity.h"
#include "data/store/lock.h"
#include "data/store/seal_writer.h"
#include "data/store/sqlite_errors.h"
#include "data/store/store.h"

namespace palpate::data {

struct Store::Impl {
  std::string path;  ///< as given; for messages
  std::string file;  ///< links followed
  Mode mode = Mode::read_only;
  int version = 0;                 ///< of the schema; an older one than ours where it is only read
  std::optional<WriterLock> lock;  // before db: given up after the database is closed
  std::optional<SQLite::Database> db;
  std::optional<SealWriter> seals;  ///< of a writer
  bool checked = false;             ///< a reader has held every session against its seals
  FileIdentity identity, wal_identity, index_identity;
  std::int64_t index_size = 0;  ///< bytes of the -shm

  Impl() = default;
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Runs `work` in a transaction that is on disk when this returns. A file that has been moved
  /// away or deleted meanwhile takes writes without a complaint: that is seen here.
  template <class Work>
  auto commit(Work&& work) {
    require_writer();
    repair_wal_index();
    return guarded(path, [&] {
      try {
        SQLite::Transaction transaction(*db, SQLite::TransactionBehavior::IMMEDIATE);
        auto result = work();
        transaction.commit();
        require_files_in_place();
        return result;
      } catch (...) {
        seals->reset_chains();
        throw;
      }
    });
  }

  /// Empties the log and rebuilds the file, so that nothing of removed rows is in either.
  void purge_deleted_rows();

  void require_writer() const;
  void require_running(const Run& run);
  void require_files_in_place();
  /// The index of the log (-shm) is mapped into memory: where something has cut it short, a look
  /// into it would end the program by SIGBUS. It gets its size back, empty; SQLite then makes it
  /// again from the log, as after a crash.
  void repair_wal_index();
  [[noreturn]] void refuse(const std::string& why) const;
};

}  // namespace palpate::data
