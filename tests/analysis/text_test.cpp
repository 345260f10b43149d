// Formatting of text for terminals, SVG and HTML.

#include "analysis/text.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {
namespace {

TEST(Padding, CountsCharacters) {
  EXPECT_EQ(pad_left("ä", 3), "  ä");
  EXPECT_EQ(pad_right("ä", 3), "ä  ");
  EXPECT_EQ(pad_left("abc", 3), "abc");
  EXPECT_EQ(pad_right("abcd", 3), "abcd") << "a longer text stays whole";
  EXPECT_EQ(pad_left("abcd", 3), "abcd");
}

TEST(Shortened, EndsInAnEllipsis) {
  EXPECT_EQ(shortened("abcde", 5), "abcde");
  EXPECT_EQ(shortened("abcdef", 5), "abcd…");
  EXPECT_EQ(shortened("äöüßé", 4), "äöü…") << "cut between characters, not bytes";
  EXPECT_EQ(shortened("ab", 1), "…");
}

TEST(Wrapped, FillsLinesAndKeepsPercentSigns) {
  const auto within = [](std::size_t columns) {
    return [columns](std::string_view line) { return line.size() <= columns; };
  };
  using Lines = std::vector<std::string>;
  EXPECT_EQ(wrapped("one two three", within(7)), (Lines{"one two", "three"}));
  EXPECT_EQ(wrapped("one two three", within(6)), (Lines{"one", "two", "three"}));
  EXPECT_EQ(wrapped("one two three", within(100)), (Lines{"one two three"}));
  EXPECT_EQ(wrapped("about 95 % of all", within(8)), (Lines{"about", "95 % of", "all"}));
  EXPECT_EQ(wrapped("all of 95 %", within(9)), (Lines{"all of", "95 %"}));
  EXPECT_EQ(wrapped("unbreakable word", within(4)), (Lines{"unbreakable", "word"}));
  EXPECT_EQ(wrapped("", within(4)), Lines{""});
}

TEST(Counted, HasTheSingularForOneOnly) {
  EXPECT_EQ(counted(0, "trial", "trials"), "0 trials");
  EXPECT_EQ(counted(1, "trial", "trials"), "1 trial");
  EXPECT_EQ(counted(2, "trial", "trials"), "2 trials");
}

TEST(Joined, HasCommasAndOneAnd) {
  using Parts = std::vector<std::string>;
  EXPECT_EQ(joined(Parts{}), "");
  EXPECT_EQ(joined(Parts{"a"}), "a");
  EXPECT_EQ(joined(Parts{"a", "b"}), "a and b");
  EXPECT_EQ(joined(Parts{"a", "b", "c", "d"}), "a, b, c and d");
}

TEST(Fixed, RoundsWithoutAnExponent) {
  EXPECT_EQ(fixed(2.5e300, 0).size(), 301U);
  EXPECT_EQ(fixed(1234.5678, 2), "1234.57");
  EXPECT_EQ(fixed(-0.0, 2), "0.00");
  EXPECT_EQ(fixed(-0.006, 2), "−0.01");
  EXPECT_EQ(p_text(0.001), "0.001");
  EXPECT_EQ(p_text(1), "1.000");
}

}  // namespace
}  // namespace palpate::analysis
