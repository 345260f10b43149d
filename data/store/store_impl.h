#pragma once
// Internal to data/: what the store_*.cpp share.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>
#include <sys/types.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/files/checksum.h"
#include "data/store/seal_writer.h"
#include "data/store/sqlite_errors.h"
#include "data/store/store.h"
#include "data/store/store_lock.h"

namespace palpate::data {

/// Which file a path leads to; {0, 0}: none.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  bool operator==(const FileIdentity&) const = default;
};
FileIdentity identity_of(const std::string& path);

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
    mend_index();
    return guarded(path, [&] {
      try {
        SQLite::Transaction transaction(*db, SQLite::TransactionBehavior::IMMEDIATE);
        auto result = work();
        transaction.commit();
        require_still_there();
        return result;
      } catch (...) {
        seals->start_anew();
        throw;
      }
    });
  }

  /// Empties the log and rebuilds the file, so that nothing of removed rows is in either.
  void clear_traces();

  void require_writer() const;
  void require_running(const Run& run);
  void require_still_there();
  /// The index of the log (-shm) is mapped into memory: where something has cut it short, a look
  /// into it would end the program by SIGBUS. It gets its size back, empty; SQLite then makes it
  /// again from the log, as after a crash.
  void mend_index();
  [[noreturn]] void refuse(const std::string& why) const;
};

/// Binds values one after the other, whatever their types.
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

/// The columns of a statement, made once for all its rows. Valid after the first step.
std::vector<SQLite::Column> columns_of(SQLite::Statement& statement);

/// Reads the columns of a row one after the other, whatever their types. Only an optional may be
/// missing. \throws SQLite::Exception (damage).
class Row {
 public:
  explicit Row(SQLite::Statement& statement) : statement_(&statement) {}
  explicit Row(const std::vector<SQLite::Column>& columns) : columns_(&columns) {}

  Row& operator>>(std::string& value) {
    return next([&](const SQLite::Column& column) {
      const void* const text = column.getBlob();  // before its length
      value.assign(static_cast<const char*>(text), static_cast<std::size_t>(column.getBytes()));
      return !value.empty() || !column.isNull();
    });
  }
  Row& operator>>(Checksum& value) {
    return next([&](const SQLite::Column& column) {
      const void* const bytes = column.getBlob();  // before their length
      if (column.isNull()) return false;
      if (column.getBytes() != static_cast<int>(value.size())) out_of_range(column.getBytes());
      std::memcpy(value.data(), bytes, value.size());
      return true;
    });
  }
  Row& operator>>(double& value) {
    return next([&](const SQLite::Column& column) {
      value = column.getDouble();
      return value != 0 || !column.isNull();
    });
  }
  Row& operator>>(int& value) { return integer(value); }
  Row& operator>>(std::uint32_t& value) { return integer(value); }
  Row& operator>>(std::int64_t& value) { return integer(value); }
  Row& operator>>(std::uint64_t& value) { return integer(value); }
  Row& operator>>(bool& value) {
    return next([&](const SQLite::Column& column) {
      const std::int64_t stored = column.getInt64();
      if (stored != 0 && stored != 1) out_of_range(stored);
      value = stored != 0;
      return value || !column.isNull();
    });
  }
  template <class T>
  Row& operator>>(std::optional<T>& value) {
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
  /// \param read returns whether there was a value; asked of SQLite only where it read 0 or "".
  template <class Read>
  Row& next(const Read& read) {
    const bool there = columns_ != nullptr ? read((*columns_)[static_cast<std::size_t>(index_)])
                                           : read(statement_->getColumn(index_));
    if (!there) missing();
    ++index_;
    return *this;
  }
  template <class T>
  Row& integer(T& value) {
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

RunEnd run_end_of(const std::string& text);

/// Within a transaction; no effect where none is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
