#pragma once
// Protection against formula injection: text cells of CSV and TSV files that a spreadsheet would
// evaluate as a formula get a leading apostrophe
// (https://owasp.org/www-community/attacks/CSV_Injection).

#include <string_view>

namespace palpate::data {

namespace formula {
constexpr bool starts_formula(std::string_view text) {
  return !text.empty() && (text[0] == '=' || text[0] == '+' || text[0] == '-' || text[0] == '@' ||
                           text[0] == '\t' || text[0] == '\r' || text[0] == '\n');
}
constexpr bool starts_formula_behind_quotes(std::string_view text) {
  while (!text.empty() && text[0] == '\'') text.remove_prefix(1);
  return starts_formula(text);
}
}  // namespace formula

/// Whether a text cell gets a leading ': it begins with = + - @ tab CR or LF, or would be read back
/// as a guarded one ('=1). Numbers are never guarded.
constexpr bool needs_guard(std::string_view text) {
  return !text.empty() && (text[0] == '\'' ? formula::starts_formula_behind_quotes(text.substr(1))
                                           : formula::starts_formula(text));
}

/// The original of a guarded text; any other text unchanged.
constexpr std::string_view unguarded(std::string_view text) {
  const bool guarded =
      !text.empty() && text[0] == '\'' && formula::starts_formula_behind_quotes(text.substr(1));
  return guarded ? text.substr(1) : text;
}

}  // namespace palpate::data
