#pragma once
// Rows of CSV and TSV files.

#include <array>
#include <charconv>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "data/export/exported_columns.h"

namespace palpate::data {

enum class DelimitedFormat {
  csv,  ///< RFC 4180: fields quoted where needed, CRLF; a missing value is an empty field
  tsv,  ///< BIDS: tab, LF; a missing value is n/a. No quoting: some texts are refused
};

/// Appends values left to right. Numbers are written as the shortest text that reads back as the
/// same number (std::to_chars), with a decimal point in every locale; booleans as 0 or 1.
class DelimitedRow {
 public:
  explicit DelimitedRow(DelimitedFormat style) : style_(style) {}

  /// "" is a missing value; texts that a spreadsheet would evaluate are guarded (text_sink.h).
  /// \throws StoreRefused: a text that TSV cannot represent (tabs, line breaks, the text "n/a").
  DelimitedRow& operator<<(std::string_view text);
  DelimitedRow& operator<<(const char* text) { return *this << std::string_view(text); }
  DelimitedRow& operator<<(bool value) { return raw(value ? "1" : "0"); }
  template <class Number>
  requires std::is_arithmetic_v<Number> DelimitedRow& operator<<(Number value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
    return raw({text.data(), static_cast<std::size_t>(end.ptr - text.data())});
  }
  /// With at most `decimals` decimals, without trailing zeros.
  DelimitedRow& rounded(double value, int decimals);
  template <class T>
  DelimitedRow& operator<<(const std::optional<T>& value) {
    return value ? *this << *value : *this << std::string_view();
  }
  DelimitedRow& operator<<(std::span<const Column> names);

  /// The row with its line end; valid until the next value is appended.
  const std::string& end();

 private:
  DelimitedRow& raw(std::string_view text);
  DelimitedRow& cell(std::string_view text);
  DelimitedFormat style_;
  std::string row_;
  bool ended_ = true;
};

}  // namespace palpate::data
