#pragma once

#include <string>
#include <utility>
#include <vector>

namespace palpate::runner {

/// A font file and the letters to take from it.
struct FontChoice {
  std::string path;
  int face = 0;                        ///< within a collection
  std::vector<unsigned short> ranges;  ///< first and last letter in pairs, ended by a 0
};

/// Fonts for the console: a clear one for European scripts, then what the letters of `texts`
/// (UTF-8) need beyond it. Empty where fontconfig knows no TrueType font at all.
std::vector<FontChoice> choose_fonts(const std::vector<std::string>& texts);

}  // namespace palpate::runner
