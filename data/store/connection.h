#pragma once
// The open database of a Store, and the transaction of every writing call.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "data/files/file_permissions.h"
#include "data/store/forget.h"
#include "data/store/seals.h"
#include "data/store/store.h"
#include "data/store/store_error.h"
#include "data/store/writer_lock.h"

namespace palpate::data {

// A store belongs to one thread at a time: without SQLite's mutex every column is read faster.
inline constexpr int kOpenRead = SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX;
inline constexpr int kOpenWrite = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;

struct Store::Impl {
  std::string path;  ///< as given; for messages
  std::string file;  ///< absolute, links resolved
  Mode mode = Mode::read_only;
  int version = 0;                 ///< of the schema; a reader may have opened an older one
  std::optional<WriterLock> lock;  // before db: released after the database is closed
  std::optional<SQLite::Database> db;
  std::optional<SealWriter> seals;  ///< of a writer
  bool seals_verified = false;      ///< a reader has verified every session of its snapshot
  FileIdentity identity, wal_identity, index_identity;
  std::int64_t index_size = 0;  ///< bytes of the -shm

  Impl() = default;
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  bool writes() const { return mode == Mode::write_or_create; }

  // Steps of Store::open, in order. \throws as Store::open; SQLite::Exception.
  void require_usable_path();
  void create_if_absent();
  void connect();
  void prepare_for_writing();

  /// Runs `work` in a transaction (BEGIN IMMEDIATE) that is on disk when this returns. SQLite does
  /// not notice when the database file is moved or deleted while it is open and reports success:
  /// require_files_in_place() detects it.
  template <class Work>
  auto commit(Work&& work) {
    require_writer();
    repair_wal_index();
    return guarded(path, [&] {
      try {
        SQLite::Transaction transaction(*db, SQLite::TransactionBehavior::IMMEDIATE);
        auto result = std::forward<Work>(work)();
        transaction.commit();
        require_files_in_place();
        return result;
      } catch (...) {
        seals->reset_chains();
        throw;
      }
    });
  }

  /// The transaction of forget: deletes the rows of a participant and keeps the tombstone.
  /// \param earlier_hash of a tombstone that this one replaces; "": none
  void replace_by_tombstone(const std::string& code, const Tombstones::Tombstone& tombstone,
                            const std::string& earlier_hash);
  /// Checkpoints and truncates the -wal and rebuilds the file (VACUUM), so that neither holds any
  /// byte of deleted rows.
  void purge_deleted_rows();

  // Parts of begin_run, within its transaction.
  std::int64_t resume_or_create_session(const Participant& participant, const RunInfo& info);
  /// Stores the protocol that the run shows, if it is not the participant's `own`.
  std::optional<std::int64_t> other_protocol(const Participant& participant, std::int64_t own,
                                             const ProtocolInfo* shown_with);

  void require_writer() const;
  void require_running(const Run& run);
  void require_files_in_place();
  /// The WAL index (-shm) is mapped into memory: if another program has truncated it, the next
  /// access would end this process with SIGBUS. Restores its size, zero-filled; SQLite then
  /// rebuilds it from the -wal, as after a crash.
  void repair_wal_index();
  [[noreturn]] void refuse(const std::string& why) const;
};

}  // namespace palpate::data
