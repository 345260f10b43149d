// Fonts of the console: one for European scripts, then those for other characters.

#include "runner/display/fonts.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate::runner::display {
namespace {
namespace console_fonts {

bool has(const FontChoice& choice, unsigned letter) {
  for (std::size_t i = 0; i + 1 < choice.ranges.size(); i += 2) {
    if (letter >= choice.ranges[i] && letter <= choice.ranges[i + 1]) return true;
  }
  return false;
}

TEST(Fonts, BeginWithOneForEuropeanScripts) {
  const std::vector<FontChoice> plain =
      choose_fonts({"Anna", "Größe", "Łódź", "Ελλάδα", "да – „so“ →"});
  if (plain.empty()) GTEST_SKIP() << "no TrueType font is installed";
  ASSERT_EQ(plain.size(), 1U) << "it has them all";
  EXPECT_TRUE(std::filesystem::is_regular_file(plain[0].path));
  for (const unsigned letter :
       {0x20U, 0x41U, 0xF6U, 0x141U, 0x3B1U, 0x434U, 0x2013U, 0x201EU, 0x2192U, 0x2212U})
    EXPECT_TRUE(has(plain[0], letter)) << letter;
  EXPECT_FALSE(has(plain[0], 0x6F22));
  EXPECT_FALSE(has(plain[0], 0x1F)) << "no control characters";
  const std::vector<FontChoice> none = choose_fonts({});
  ASSERT_EQ(none.size(), 1U);
  EXPECT_EQ(none[0].path, plain[0].path);
}

TEST(Fonts, HaveOnlyLettersOfTheirScript) {
  const std::vector<FontChoice> choices = choose_fonts({"Anna \u05D0\u05D1", "\u0531 \u2660"});
  if (choices.empty()) GTEST_SKIP() << "no TrueType font is installed";
  EXPECT_TRUE(has(choices[0], 'A'));
  for (std::size_t i = 0; i < choices.size(); ++i) {
    ASSERT_FALSE(choices[i].ranges.empty());
    EXPECT_EQ(choices[i].ranges.back(), 0) << "ends";
    EXPECT_EQ(choices[i].ranges.size() % 2, 1U) << "pairs, and the end";
  }
  // Beyond the first font, each letter is in at most one.
  for (const unsigned letter : {0x5D0U, 0x5D1U, 0x531U, 0x2660U}) {
    std::size_t fonts = 0;
    for (std::size_t i = 1; i < choices.size(); ++i) fonts += has(choices[i], letter);
    EXPECT_LE(fonts, 1U) << letter;
  }
  for (std::size_t i = 1; i < choices.size(); ++i) EXPECT_FALSE(has(choices[i], 'A'));
}

}  // namespace console_fonts
}  // namespace
}  // namespace palpate::runner::display
