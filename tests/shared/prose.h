#pragma once
// Whether a text that people read is whole, whatever it says.

#include <string>

namespace palpate::testing {

/// The fault of its form, where a part is missing as a rule; empty: none.
inline std::string flaw_of(const std::string& text) {
  if (text.empty()) return "nothing is said";
  for (const char* within :
       {"  ", " ,", " ;", ",,", ", ,", "()", "( ", "(,", ": ;", ":;", " )", ";.", ",.", ":."})
    if (text.find(within) != std::string::npos) return std::string("'") + within + "' within";
  const std::string between = " ,:;(/";
  if (between.find(text.front()) != std::string::npos) return "begins in the middle";
  if (between.find(text.back()) != std::string::npos) return "ends in the middle";
  for (const char* last : {" of", " and", " or", " from", " to", " than", " a", " the"})
    if (text.ends_with(last)) return std::string("ends with") + last;
  int open = 0;
  for (const char c : text) open += (c == '(') - (c == ')');
  return open == 0 ? "" : "a bracket is not closed";
}

}  // namespace palpate::testing
