#pragma once
// Internal to data/store: the open database of a Store, and the transaction of every writing call.

#include <SQLiteCpp/Column.h>
#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/base/checksum.h"
#include "data/files/file_permissions.h"
#include "data/store/forget.h"
#include "data/store/seals.h"
#include "data/store/store.h"

namespace palpate::data {

// SQLite's result codes (https://www.sqlite.org/rescode.html) as messages that name a remedy.

/// \throws StoreRefused: the file is damaged or not a database; StoreError: any other `error`.
[[noreturn]] void raise_store_error(const std::string& path, const SQLite::Exception& error);

/// Calls `work` and converts SQLite's exceptions to StoreError and StoreRefused.
template <class Work>
decltype(auto) guarded(const std::string& path, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const SQLite::Exception& error) {
    raise_store_error(path, error);
  }
}

// Binds C++ values to the parameters of a SQL statement, and reads them from the columns of a
// result row, in order. Checks every value read against the range of its type: the file may be
// damaged.

/// Binds values to the parameters of a statement, left to right.
class Binder {
 public:
  explicit Binder(SQLite::Statement& statement) : statement_(statement) {}
  Binder& operator<<(const std::string& value) { return bind(value); }
  Binder& operator<<(const char* value) { return bind(value); }
  Binder& operator<<(double value) { return bind(value); }
  Binder& operator<<(int value) { return bind(value); }
  Binder& operator<<(std::uint32_t value) { return bind(static_cast<std::int64_t>(value)); }
  Binder& operator<<(std::int64_t value) { return bind(value); }
  Binder& operator<<(std::uint64_t value) { return bind(static_cast<std::int64_t>(value)); }
  Binder& operator<<(const Checksum& value) {
    statement_.bind(++index_, value.data(), static_cast<int>(value.size()));
    return *this;
  }
  Binder& operator<<(bool value) { return bind(value ? 1 : 0); }
  template <class T>
  Binder& operator<<(const std::optional<T>& value) {
    if (value) return *this << *value;
    statement_.bind(++index_);
    return *this;
  }

 private:
  template <class T>
  Binder& bind(const T& value) {
    statement_.bind(++index_, value);
    return *this;
  }
  SQLite::Statement& statement_;
  int index_ = 0;
};

/// The result columns of a statement, created once for all its rows. Valid after the first step.
std::vector<SQLite::Column> columns_of(SQLite::Statement& statement);

/// Reads the columns of a result row, left to right. NULL is read into a std::optional only.
/// \throws SQLite::Exception (SQLITE_CORRUPT): NULL, or a value out of the range of its type.
class RowReader {
 public:
  explicit RowReader(SQLite::Statement& statement) : statement_(&statement) {}
  explicit RowReader(const std::vector<SQLite::Column>& columns) : columns_(&columns) {}

  RowReader& operator>>(std::string& value) {
    return next([&](const SQLite::Column& column) {
      const void* const text = column.getBlob();  // must precede getBytes()
      value.assign(static_cast<const char*>(text), static_cast<std::size_t>(column.getBytes()));
      return !value.empty() || !column.isNull();
    });
  }
  RowReader& operator>>(Checksum& value) {
    return next([&](const SQLite::Column& column) {
      const void* const bytes = column.getBlob();  // must precede getBytes()
      if (column.isNull()) return false;
      if (column.getBytes() != static_cast<int>(value.size())) out_of_range(column.getBytes());
      std::memcpy(value.data(), bytes, value.size());
      return true;
    });
  }
  RowReader& operator>>(double& value) {
    return next([&](const SQLite::Column& column) {
      value = column.getDouble();
      return value != 0 || !column.isNull();
    });
  }
  RowReader& operator>>(int& value) { return integer(value); }
  RowReader& operator>>(std::uint32_t& value) { return integer(value); }
  RowReader& operator>>(std::int64_t& value) { return integer(value); }
  RowReader& operator>>(std::uint64_t& value) { return integer(value); }
  RowReader& operator>>(bool& value) {
    return next([&](const SQLite::Column& column) {
      const std::int64_t stored = column.getInt64();
      if (stored != 0 && stored != 1) out_of_range(stored);
      value = stored != 0;
      return value || !column.isNull();
    });
  }
  template <class T>
  RowReader& operator>>(std::optional<T>& value) {
    bool null = false;
    next([&](const SQLite::Column& column) {
      null = column.isNull();
      return true;
    });
    if (null) {
      value.reset();
      return *this;
    }
    --index_;
    return *this >> value.emplace();
  }

 private:
  /// \param read returns whether the column was not NULL; checks it only after reading 0 or "".
  template <class Read>
  RowReader& next(const Read& read) {
    const bool present = columns_ != nullptr ? read((*columns_)[static_cast<std::size_t>(index_)])
                                             : read(statement_->getColumn(index_));
    if (!present) missing();
    ++index_;
    return *this;
  }
  template <class T>
  RowReader& integer(T& value) {
    return next([&](const SQLite::Column& column) {
      const std::int64_t stored = column.getInt64();
      if (!std::in_range<T>(stored)) out_of_range(stored);
      value = static_cast<T>(stored);
      return stored != 0 || !column.isNull();
    });
  }
  [[noreturn]] void missing() const;
  [[noreturn]] void out_of_range(std::int64_t stored) const;
  std::string column_name() const;
  SQLite::Statement* statement_ = nullptr;
  const std::vector<SQLite::Column>* columns_ = nullptr;
  int index_ = 0;
};

// Internal to data/store: one writer per database, across processes.

/// Two advisory locks (flock), held until destruction or until the process ends. The first is on
/// the file `path`.palpate-lock, which contains the process id of the holder and is removed with
/// the lock; the file of a killed process is reused. The second is on the database itself, because
/// one database may have several names (hard links, a file mounted elsewhere, a file that was
/// moved), and each name has a lock file and a log of its own.
///
/// Closing a descriptor of the database releases SQLite's POSIX locks of this process
/// (https://www.sqlite.org/howtocorrupt.html, 2.2): destroy the lock after the database is closed.
class WriterLock {
 public:
  /// \param path of the database, links resolved; need not exist
  /// \throws StoreRefused: another writer holds it (names the process), or the file is not a lock
  /// of palpate; StoreError: the lock file cannot be created.
  explicit WriterLock(const std::string& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

  /// Locks the file that `path` names by now: after it was created or replaced. To be called while
  /// the database is closed. \throws StoreRefused: a writer holds it under another name
  void lock_database();

 private:
  void release();

  std::string path_, file_;
  int descriptor_ = -1, database_ = -1;
};

/// Refuses to write to a database with several hard links: under each name SQLite keeps another
/// log, so that trials acknowledged under one name would be overwritten under the other. \param
/// file links resolved \throws StoreRefused
void require_one_name(const std::string& file, const std::string& path);

/// Refuses an export, which records itself beside a session without the lock, where a writer has
/// opened the database by another name: its newest trials are in the log of that name. To be called
/// while the database is closed. \param file links resolved \throws StoreRefused
void require_no_writer_by_another_name(const std::string& file, const std::string& path);

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
