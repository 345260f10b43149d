#pragma once
// Binds C++ values to the parameters of a SQL statement, and reads them from the columns of a
// result row, in order. Checks every value read against the range of its type: the file may be
// damaged.

#include <SQLiteCpp/Column.h>
#include <SQLiteCpp/Statement.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/base/checksum.h"

namespace palpate::data {

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

}  // namespace palpate::data
