// A program is asked for the levels; without one they cover the range.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"

namespace palpate::protocols {
namespace {

TEST(Asked, OwnLevelsFallOnceInEachSixtyFourth) {
  for (const LevelScale scale : {LevelScale::linear, LevelScale::log10}) {
    const ProcedureSpec spec = Asked{.min = 2, .max = 50, .scale = scale, .stop_trials = 64};
    for (const std::uint64_t seed : {1U, 2U, 77U}) {
      Procedure procedure(spec, seed);
      const double low = scale_position(scale, 2), high = scale_position(scale, 50);
      std::vector<double> places;
      while (const auto level = procedure.next_level()) {
        EXPECT_GE(*level, 2);
        EXPECT_LE(*level, 50);
        places.push_back((scale_position(scale, *level) - low) / (high - low));
        procedure.record({*level, true});
      }
      ASSERT_EQ(places.size(), 64U);
      std::ranges::sort(places);
      for (std::size_t i = 1; i < places.size(); ++i)
        EXPECT_NEAR(places[i] - places[i - 1], 1.0 / 64, 1e-9);
    }
  }
}

TEST(Asked, LevelsOfTheProgramLeaveTheNextOnes) {
  const ProcedureSpec spec = Asked{.min = 0, .max = 1, .stop_trials = 8};
  Procedure own(spec, 3), asked(spec, 3);
  for (int i = 0; i < 8; ++i) {
    ASSERT_EQ(own.next_level(), asked.next_level());
    own.record({*own.next_level(), true});
    asked.record({0.123, false});
  }
  EXPECT_FALSE(asked.next_level());
  EXPECT_EQ(asked.history().back().level, 0.123);
  EXPECT_FALSE(asked.estimate().threshold);
  EXPECT_EQ(expected_trials(spec, Procedure(spec, 3)), 8);
}

}  // namespace
}  // namespace palpate::protocols
