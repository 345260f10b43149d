#pragma once
// A table in memory, column by column.

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace palpate::data {

/// A table filled from left to right, row by row, like a CSV file.
class ColumnTable {
 public:
  /// Booleans are bytes, 0 or 1. A missing number is NaN, a missing text "".
  using Cells = std::variant<std::vector<double>, std::vector<std::int64_t>,
                             std::vector<std::uint8_t>, std::vector<std::string>>;
  struct Column {
    std::string name;
    Cells cells;
  };

  explicit ColumnTable(const std::vector<std::string>& names);

  // All values of a column have one type. \throws std::logic_error
  ColumnTable& operator<<(double value) { return append(value); }
  ColumnTable& operator<<(bool value) { return append(std::uint8_t{value}); }
  ColumnTable& operator<<(std::integral auto value) {
    return append(static_cast<std::int64_t>(value));
  }
  ColumnTable& operator<<(std::string_view text) { return append(std::string(text)); }
  ColumnTable& operator<<(const char* text) { return append(std::string(text)); }
  ColumnTable& operator<<(const std::optional<double>& value) {
    return append(value.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  /// Ends a row. \throws std::logic_error: a column has no value yet
  void end_row();

  std::size_t rows() const { return rows_; }
  const std::vector<Column>& columns() const { return columns_; }

 private:
  template <class T>
  ColumnTable& append(T value);

  std::vector<Column> columns_;
  std::size_t rows_ = 0, next_ = 0;
};

}  // namespace palpate::data
