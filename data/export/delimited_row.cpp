#include "data/export/delimited_row.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "data/errors.h"
#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

bool quotes_needed(std::string_view text) {
  // Without early exit, so that compilers vectorise the loop.
  bool needed = false;
  for (const char c : text) needed |= c == ',' || c == '"' || c == '\r' || c == '\n';
  return needed;
}

bool fits_tsv(std::string_view text) {
  return text != "n/a" && std::none_of(text.begin(), text.end(),
                                       [](char c) { return c == '\t' || c == '\r' || c == '\n'; });
}

}  // namespace

DelimitedRow& DelimitedRow::raw(std::string_view text) {
  if (ended_) {
    row_.clear();
    ended_ = false;
  } else {
    row_ += style_ == DelimitedFormat::csv ? ',' : '\t';
  }
  row_ += text;
  return *this;
}

DelimitedRow& DelimitedRow::operator<<(std::string_view text) {
  return needs_guard(text) ? cell("'" + std::string(text)) : cell(text);
}

DelimitedRow& DelimitedRow::cell(std::string_view text) {
  if (style_ == DelimitedFormat::tsv) {
    if (!fits_tsv(text)) {
      throw StoreRefused("the text '" + std::string(text) +
                         "' cannot be written to a TSV file (tab, line break or the text n/a); "
                         "export as csv or psych-ds");
    }
    return raw(text.empty() ? "n/a" : text);
  }
  if (!quotes_needed(text)) return raw(text);
  raw("\"");
  for (const char c : text) row_.append(c == '"' ? 2 : 1, c);
  row_ += '"';
  return *this;
}

DelimitedRow& DelimitedRow::operator<<(std::span<const Column> names) {
  for (const Column& column : names) raw(column.name);
  return *this;
}

DelimitedRow& DelimitedRow::rounded(double value, int decimals) {
  std::array<char, 400> text{};  // the largest double has 309 digits
  const auto made = std::to_chars(text.data(), text.data() + text.size(), value,
                                  std::chars_format::fixed, decimals);
  std::string_view shown(text.data(), static_cast<std::size_t>(made.ptr - text.data()));
  if (shown.find('.') != std::string_view::npos) {
    shown.remove_suffix(shown.size() - 1 - shown.find_last_not_of('0'));
    if (shown.back() == '.') shown.remove_suffix(1);
  }
  return raw(shown == "-0" ? "0" : shown);
}

const std::string& DelimitedRow::end() {
  row_ += style_ == DelimitedFormat::csv ? "\r\n" : "\n";
  ended_ = true;
  return row_;
}

}  // namespace palpate::data
