#pragma once
// CSV whose numbers have 17 significant digits, so that they read back exactly everywhere.

#include <array>
#include <concepts>
#include <cstdio>
#include <string>
#include <string_view>

namespace palpate::runner {

/// Rows are appended to from left to right. No field gets quotes: texts are names of letters,
/// digits, '-' and '+'.
class CsvText {
 public:
  /// \param names  of the columns. \param line_end  "\n" or "\r\n"
  CsvText(const auto& names, std::string line_end) : line_end_(std::move(line_end)) {
    for (const auto& name : names) *this << std::string_view(name);
    end_row();
  }
  CsvText& operator<<(double value) {
    std::array<char, 40> digits{};
    const int length = std::snprintf(digits.data(), digits.size(), "%.17g", value);
    return *this << std::string_view(digits.data(), static_cast<std::size_t>(length));
  }
  CsvText& operator<<(std::string_view text) {
    if (!first_) text_ += ',';
    text_ += text;
    first_ = false;
    return *this;
  }
  CsvText& operator<<(const char* text) { return *this << std::string_view(text); }
  CsvText& operator<<(bool value) { return *this << std::string_view(value ? "1" : "0"); }
  CsvText& operator<<(std::integral auto value) {
    return *this << std::string_view(std::to_string(value));
  }
  void end_row() {
    text_ += line_end_;
    first_ = true;
  }
  const std::string& text() const { return text_; }

 private:
  std::string line_end_, text_;
  bool first_ = true;  ///< the next field of the row
};

}  // namespace palpate::runner
