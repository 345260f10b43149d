#pragma once
// Internal to data/: one row of a CSV or TSV file.

#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "data/export/columns.h"

namespace palpate::data {

enum class TableStyle {
  csv,  ///< RFC 4180: fields quoted where needed, CRLF; a missing value is an empty field
  tsv,  ///< BIDS: tab, LF; a missing value is n/a. There is no quoting: see TableRow::text
};

/// Builds a row value by value. Numbers are the shortest text that reads back as the same number,
/// never with a decimal comma; booleans are 0 or 1.
class TableRow {
 public:
  explicit TableRow(TableStyle style) : style_(style) {}

  /// "" is a missing value; what a spreadsheet would run is guarded (spreadsheet_text.h).
  /// \throws StoreRefused: a text that this style cannot hold (TSV: tabs, line breaks, the text
  /// "n/a").
  TableRow& operator<<(std::string_view text);
  TableRow& operator<<(const char* text) { return *this << std::string_view(text); }
  TableRow& operator<<(bool value) { return raw(value ? "1" : "0"); }
  template <class Number>
  requires std::is_arithmetic_v<Number> TableRow& operator<<(Number value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
    return raw({text.data(), static_cast<std::size_t>(end.ptr - text.data())});
  }
  /// With at most so many decimals, zeros at the end left out.
  TableRow& rounded(double value, int decimals);
  template <class T>
  TableRow& operator<<(const std::optional<T>& value) {
    return value ? *this << *value : *this << std::string_view();
  }
  TableRow& operator<<(std::span<const Column> names);

  /// The row with its end; valid until the next one is begun.
  const std::string& end();

 private:
  TableRow& raw(std::string_view text);
  TableRow& cell(std::string_view text);
  TableStyle style_;
  std::string row_;
  bool ended_ = true;
};

}  // namespace palpate::data
