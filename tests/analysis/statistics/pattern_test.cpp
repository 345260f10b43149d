#include "analysis/statistics/pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace palpate::analysis {
namespace {

const std::vector<std::string> kNames{"cone", "cube",    "sphere", "my-shape",
                                      "none", "a.b.c_1", "a.b:c.p"};
const std::vector<double> kValues{10, 4, -2, 7, std::nan(""), 6, 0.02};

std::optional<std::size_t> resolve(const std::string& name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<std::size_t>(found - kNames.begin());
}

std::optional<bool> holds(const std::string& expression) {
  return Pattern(expression, resolve, kNames).holds([](std::size_t column) {
    return kValues[column];
  });
}

TEST(Pattern, HoldsOrNot) {
  for (const char* yes : {"cone>5",
                          "cone > 5 && cube > 3",
                          "cone==10",
                          "cone != cube",
                          "sphere <= -2",
                          "!(cone<5)",
                          "cone > 5 && cube > 5 || sphere < 0",
                          "min(cone,cube) > max(sphere, 3)",
                          "abs(sphere) == 2",
                          "2 + 3 * cube == 14",
                          "(2 + 3) * cube == 20",
                          "cone - cube - 1 == 5",
                          "cone / cube / 2.5 == 1",
                          "--cone == 10",
                          "-cone < 0",
                          "1e1 == cone",
                          ".5 * cone == 5",
                          "'my-shape' == 7",
                          "\"my-shape\" > cube",
                          "!!(cone > 5)",
                          "max(cone) == 10",
                          "! (cone < 5) && !(cube < 1)",
                          "((((cone))))>\t5",
                          "cone!=cube",
                          "a.b.c_1 == 6",
                          "a.b:c.p<.05",
                          "'a.b.c_1'*.5 == 3",
                          "min(cone, max(cube, sphere), 99) == 4"}) {
    EXPECT_EQ(holds(yes), true) << yes;
  }
  for (const char* no : {"cone < 5", "cone > 5 && cube > 5", "cone < 5 || cube > 5", "!(cone > 5)",
                         "cone - (cube - 1) == 5", "sphere > 0", "cone > 10", "cone < 10"}) {
    EXPECT_EQ(holds(no), false) << no;
  }
}

TEST(Pattern, AndBindsTighterThanOr) {
  EXPECT_EQ(holds("cone > 5 || cube > 5 && sphere > 5"), true);
  EXPECT_EQ(holds("(cone > 5 || cube > 5) && sphere > 5"), false);
}

// A pattern is known where an undefined figure cannot change it.
TEST(Pattern, UndefinedValuesMatterOnlyWhereTheyCount) {
  for (const char* unknown :
       {"none > 5", "!(none > 5)", "none > 5 && cone > 5", "none > 5 || cone < 5", "none == none",
        "min(cone, none) > 0", "max(none, cone) > 0", "none * 0 == 0", "abs(none) >= 0"}) {
    EXPECT_EQ(holds(unknown), std::nullopt) << unknown;
  }
  EXPECT_EQ(holds("none > 5 && cone < 5"), false);
  EXPECT_EQ(holds("cone > 5 || none > 5"), true);
}

TEST(Pattern, ErrorsNameTheirPlaceAndWhatIsExpected) {
  struct Case {
    const char* expression;
    std::size_t place;
    const char* expected;
  };
  for (const Case& one : {Case{"", 0, "the expression ends"},
                          {"cone >", 6, "the expression ends"},
                          {"cone", 0, "this is a number"},
                          {"cone > 5 && cube", 12, "this is a number"},
                          {"cone > 5 > 3", 9, "one comparison at a time"},
                          {"(cone > 5) + 1 > 0", 0, "this is a condition"},
                          {"cone > 5 cube", 9, "an operator or the end"},
                          {"(cone > 5", 9, "')'"},
                          {"cone > 5)", 8, "an operator or the end"},
                          {"cone = 5", 5, "=="},
                          {"con > 5", 0, "did you mean cone?"},
                          {"zzzzzzzzz > 5", 0, "such as cone, cube, sphere, 'my-shape', none"},
                          {"my_shape > 5", 0, "did you mean 'my-shape'?"},
                          {"'my-shap' > 5", 0, "did you mean 'my-shape'?"},
                          {"sqrt(cone) > 2", 0, "min, max and abs"},
                          {"abs(cone, cube) > 2", 0, "one value"},
                          {"min(cone cube) > 2", 9, "',' or ')'"},
                          {"min(cone > 2) > 2", 4, "this is a condition"},
                          {"'my-shape > 2", 0, "quotation mark"},
                          {"cone > 5 & cube > 5", 9, "an operator or the end"},
                          {"cone > 3x", 8, "an operator after the number"},
                          {"cone > #", 7, "a number, a name or '('"},
                          {"!cone", 1, "this is a number"},
                          {"-(cone > 5) > 1", 1, "this is a condition"}}) {
    try {
      holds(one.expression);
      ADD_FAILURE() << one.expression << " is accepted";
    } catch (const PatternError& error) {
      EXPECT_EQ(error.place(), one.place) << error.what();
      EXPECT_NE(std::string(error.what()).find(one.expected), std::string::npos) << error.what();
    }
  }
}

TEST(Pattern, DeepNestingIsRefusedAndNotACrash) {
  const std::string many(100000, '(');
  EXPECT_THROW(holds(many + "cone > 5"), PatternError);
  EXPECT_THROW(holds(std::string(100000, '!') + "(cone > 5)"), PatternError);
  EXPECT_THROW(holds(std::string(100000, '-') + "cone > 5"), PatternError);
  EXPECT_EQ(holds(std::string(90, '(') + "cone > 5" + std::string(90, ')')), true);
}

}  // namespace
}  // namespace palpate::analysis
