#pragma once

#include <string>
#include <utility>
#include <vector>

namespace palpate::runner {

/// A font file and the characters to load from it.
struct FontChoice {
  std::string path;
  int face = 0;                        ///< within a collection
  std::vector<unsigned short> ranges;  ///< pairs of first and last character, ended by a 0
};

/// Fonts for the console: one for European scripts, then those that the other characters of `texts`
/// (UTF-8) need. Empty where fontconfig has no TrueType font.
std::vector<FontChoice> choose_fonts(const std::vector<std::string>& texts);

}  // namespace palpate::runner
