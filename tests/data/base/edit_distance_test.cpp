#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "data/base/text.h"

namespace palpate {
namespace {

TEST(EditDistance, CountsInsertedDeletedAndReplacedBytes) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("cone", "cone"), 0U);
  EXPECT_EQ(edit_distance("", "cube"), 4U);
  EXPECT_EQ(edit_distance("cube", ""), 4U);
  EXPECT_EQ(edit_distance("radius", "radus"), 1U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("ab", "ba"), 2U);
}

TEST(EditDistance, IsAMetric) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  std::vector<std::string> words;
  for (int i = 0; i < 12; ++i) {
    std::string word;
    for (int n = static_cast<int>(random.unit() * 6); n > 0; --n)
      word += static_cast<char>('a' + static_cast<int>(random.unit() * 3));
    words.push_back(word);
  }
  for (const std::string& a : words) {
    for (const std::string& b : words) {
      EXPECT_EQ(edit_distance(a, b) == 0, a == b);
      EXPECT_EQ(edit_distance(a, b), edit_distance(b, a));
      for (const std::string& c : words)
        EXPECT_LE(edit_distance(a, c), edit_distance(a, b) + edit_distance(b, c));
    }
  }
}

TEST(EditDistance, SuggestsTheNearestWord) {
  const std::vector<std::string> known = {"analyze", "export", "plan", "run"};
  EXPECT_EQ(nearest_word("analyse", known), "analyze");
  EXPECT_EQ(nearest_word("exprot", known), "export");
  EXPECT_EQ(nearest_word("plan", known), "plan");
  EXPECT_EQ(nearest_word("simulation", known), "");
  EXPECT_EQ(nearest_word("", known), "");
  EXPECT_EQ(nearest_word("anal", known), "analyze") << "the beginning of one word";
  EXPECT_EQ(nearest_word("re", {"render", "replay"}), "") << "of two";
  EXPECT_EQ(nearest_word("x", {}), "");
}

}  // namespace
}  // namespace palpate
