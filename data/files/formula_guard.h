#pragma once
// Texts in CSV and TSV files that a spreadsheet would run as a formula.

#include <string_view>

namespace palpate::data {

namespace spreadsheet {
constexpr bool runs(std::string_view text) {
  return !text.empty() && (text[0] == '=' || text[0] == '+' || text[0] == '-' || text[0] == '@' ||
                           text[0] == '\t' || text[0] == '\r' || text[0] == '\n');
}
constexpr bool runs_behind_quotes(std::string_view text) {
  while (!text.empty() && text[0] == '\'') text.remove_prefix(1);
  return runs(text);
}
}  // namespace spreadsheet

/// Whether a text cell gets a ' in front: it begins with = + - @ tab CR or LF, or would be taken
/// for a guarded one ('=1). Numbers are never guarded.
constexpr bool needs_guard(std::string_view text) {
  return !text.empty() && (text[0] == '\'' ? spreadsheet::runs_behind_quotes(text.substr(1))
                                           : spreadsheet::runs(text));
}

/// The text as it was before it was guarded; any other text as it is.
constexpr std::string_view unguarded(std::string_view text) {
  const bool guarded =
      !text.empty() && text[0] == '\'' && spreadsheet::runs_behind_quotes(text.substr(1));
  return guarded ? text.substr(1) : text;
}

}  // namespace palpate::data
