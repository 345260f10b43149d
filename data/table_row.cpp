#include "data/table_row.h"

#include <algorithm>

#include "data/store.h"

namespace palpate {
namespace {

bool quotes_needed(std::string_view text) {
  // Without a way out: compilers make that 16 characters and more at a time.
  bool needed = false;
  for (const char c : text) needed |= c == ',' || c == '"' || c == '\r' || c == '\n';
  return needed;
}

bool fits_tsv(std::string_view text) {
  return text != "n/a" && std::none_of(text.begin(), text.end(),
                                       [](char c) { return c == '\t' || c == '\r' || c == '\n'; });
}

}  // namespace

TableRow& TableRow::raw(std::string_view text) {
  if (ended_) {
    row_.clear();
    ended_ = false;
  } else {
    row_ += style_ == TableStyle::csv ? ',' : '\t';
  }
  row_ += text;
  return *this;
}

TableRow& TableRow::operator<<(std::string_view text) {
  if (style_ == TableStyle::tsv) {
    if (!fits_tsv(text)) {
      throw StoreRefused("the text '" + std::string(text) +
                         "' cannot stand in a TSV file (tab, line break or the mark of a missing "
                         "value); export as csv or psych-ds");
    }
    return raw(text.empty() ? "n/a" : text);
  }
  if (!quotes_needed(text)) return raw(text);
  raw("\"");
  for (const char c : text) row_.append(c == '"' ? 2 : 1, c);
  row_ += '"';
  return *this;
}

TableRow& TableRow::operator<<(std::span<const Column> names) {
  for (const Column& column : names) raw(column.name);
  return *this;
}

const std::string& TableRow::end() {
  row_ += style_ == TableStyle::csv ? "\r\n" : "\n";
  ended_ = true;
  return row_;
}

}  // namespace palpate
