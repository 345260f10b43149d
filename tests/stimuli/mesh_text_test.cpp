// Words, numbers and messages of mesh files.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "stimuli/mesh_formats.h"

namespace palpate::stimuli {
namespace {
namespace mesh_text {

TEST(MeshText, WordsAreQuotedCutAndWithoutControlCharacters) {
  EXPECT_EQ(in_quotes("nan"), "\"nan\"");
  EXPECT_EQ(in_quotes(""), "\"\"");
  EXPECT_EQ(in_quotes(std::string(40, 'x')), '"' + std::string(40, 'x') + '"');
  EXPECT_EQ(in_quotes(std::string(41, 'x')), '"' + std::string(40, 'x') + "...\"");
  EXPECT_EQ(in_quotes(std::string("a\x1b\n\0\x7f\xC3 ~", 8)), "\"a????? ~\"");
}

TEST(MeshText, WordsAreSeparatedByBlanks) {
  using Words = std::vector<std::string_view>;
  EXPECT_EQ(words_of("v 1  2.5\t-3\r"), (Words{"v", "1", "2.5", "-3"}));
  EXPECT_EQ(words_of("  f"), Words{"f"});
  EXPECT_EQ(words_of(" \t "), Words{});
  EXPECT_EQ(words_of(""), Words{});
}

TEST(MeshText, NumbersAreDecimalFiniteAndWhole) {
  for (const auto& [word, expected] : std::vector<std::pair<std::string, double>>{
           {"0", 0}, {"-0.5", -0.5}, {"1e-3", 0.001}, {".25", 0.25}, {"3.", 3}, {"1e-999", 0}}) {
    double value = 77;
    EXPECT_TRUE(parse_number(word, value)) << word;
    EXPECT_EQ(value, expected) << word;
  }
  for (const char* const word : {"", "x", "1x", "nan", "inf", "1e999", "-", "1,5", "0x10", "1 2"}) {
    double value = 77;
    EXPECT_FALSE(parse_number(word, value)) << word;
  }
}

TEST(MeshText, TwentyFaultsAreListedAndTheOthersCounted) {
  for (const std::size_t count : {0U, 1U, 20U, 21U, 50U}) {
    FileFaults faults("box.obj");
    for (std::size_t line = 1; line <= count; ++line) faults.add_line(line, "a number", "x");
    if (count == 0) {
      EXPECT_NO_THROW(faults.throw_if_any());
      continue;
    }
    try {
      faults.throw_if_any();
      ADD_FAILURE() << count;
    } catch (const MeshError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("box.obj: line 1: expected a number, found \"x\""), std::string::npos)
          << text;
      EXPECT_EQ(std::ranges::count(text, '\n') + 1,
                static_cast<long>(std::min<std::size_t>(count, 20) + (count > 20)))
          << text;
      EXPECT_EQ(text.find("more faults") != std::string::npos, count > 20);
      if (count > 20) {
        EXPECT_NE(text.find("box.obj: " + std::to_string(count - 20) + " more"), std::string::npos);
      }
    }
  }
}

TEST(MeshText, NumbersOfAFileGiveTheirPrecision) {
  const auto error_of = [](const std::vector<std::string>& words) {
    NumberPrecision precision;
    for (const std::string& word : words) {
      double value = 0;
      EXPECT_TRUE(parse_number(word, value));
      precision.add(word, value);
    }
    return precision.coordinate_error();
  };
  // printf's %.12f: half of the last decimal, whatever the size.
  EXPECT_NEAR(error_of({"0.030000000001", "1.250000000003", "-0.100000000007"}), 0.5e-12, 1e-15);
  // As many digits as in the longest number (12), relative to the largest.
  const double by_digits = error_of({"0.0312345678912", "-1.5", "0.25"});
  EXPECT_GT(by_digits, 0.49e-12);
  EXPECT_LT(by_digits, 1.5e-11);
  // Short numbers: not better than single precision.
  EXPECT_GT(error_of({"0.03", "-0.05", "1"}), 0.25 * std::numeric_limits<float>::epsilon());
}

}  // namespace mesh_text
}  // namespace
}  // namespace palpate::stimuli
