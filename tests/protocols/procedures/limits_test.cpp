#include <gtest/gtest.h>

#include <algorithm>

#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {

/// Answers of a participant with exactly this threshold.
template <class Run>
std::vector<double> shown_to(Run& run, double threshold, Easier easier = Easier::higher) {
  std::vector<double> levels;
  while (const auto level = run.next_level()) {
    levels.push_back(*level);
    run.record({*level, (*level > threshold) == (easier == Easier::higher)});
  }
  return levels;
}

Limits limits_to_ten() {
  Limits spec;
  spec.low = 1;
  spec.high = 10;
  spec.series = 2;
  return spec;
}

TEST(LimitsProcedure, SeriesEndWhereTheAnswerChanges) {
  LimitsRun run(limits_to_ten(), 1);
  EXPECT_EQ(shown_to(run, 3.2), (std::vector<double>{1, 2, 3, 4, 10, 9, 8, 7, 6, 5, 4, 3}));
  EXPECT_EQ(run.estimate().threshold, 3.5);
  EXPECT_EQ(run.estimate().trials, 12);
}

TEST(LimitsProcedure, DescendingFirstAndLowerIsEasier) {
  Limits spec = limits_to_ten();
  spec.ascending_first = false;
  spec.easier = Easier::lower;
  LimitsRun run(spec, 1);
  EXPECT_EQ(shown_to(run, 8.1, Easier::lower),
            (std::vector<double>{10, 9, 8, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(run.estimate().threshold, 8.5);
}

TEST(LimitsProcedure, NoThresholdIsEstimatedOutsideTheRange) {
  LimitsRun run(limits_to_ten(), 1);
  EXPECT_EQ(shown_to(run, 99).size(), 11u);  // ten without a change; the other changes at once
  EXPECT_EQ(run.estimate().at_limit, 1);
  EXPECT_EQ(run.estimate().threshold, 10.5);
}

TEST(LimitsProcedure, StepsOnALogarithmicScale) {
  Limits spec;
  spec.low = 0.01;
  spec.high = 1;
  spec.step = 0.5;
  spec.scale = LevelScale::log10;
  EXPECT_EQ(series_levels(spec, true, 0),
            (std::vector<double>{0.01, 0.0316227766017, 0.1, 0.316227766017, 1}));
  EXPECT_EQ(series_levels(spec, false, 2), (std::vector<double>{0.1, 0.0316227766017, 0.01}));
}

TEST(LimitsProcedure, StartsVaryWithTheSeed) {
  Limits spec = limits_to_ten();
  spec.jitter_steps = 3;
  spec.series = 40;
  std::vector<int> starts(4);
  LimitsRun run(spec, 7);
  bool ascending = true, first = true;
  while (const auto level = run.next_level()) {
    if (first && ascending) ++starts.at(static_cast<std::size_t>(*level) - 1);
    const bool success = *level > 5;
    run.record({*level, success});
    first = success == ascending;  // the series has ended
    if (first) ascending = !ascending;
  }
  for (const int count : starts) EXPECT_GT(count, 0);
  EXPECT_NEAR(*run.estimate().threshold, 5.5, 1e-12);
}

TEST(ConstantStimuliProcedure, EachRoundHasEveryLevelOnce) {
  const ConstantStimuli spec{{5, 3, 1, 4}, 50};
  ConstantStimuliRun run(spec, 9);
  const std::vector<double> shown = shown_to(run, 2);
  ASSERT_EQ(shown.size(), 200u);
  int alike = 0;
  for (std::size_t round = 0; round < 50; ++round) {
    std::vector<double> levels(shown.begin() + static_cast<long>(4 * round),
                               shown.begin() + static_cast<long>(4 * round + 4));
    alike += levels == spec.levels ? 1 : 0;
    std::sort(levels.begin(), levels.end());
    EXPECT_EQ(levels, (std::vector<double>{1, 3, 4, 5}));
  }
  EXPECT_LT(alike, 10);  // one in 24
  ConstantStimuliRun other(spec, 10);
  EXPECT_NE(shown_to(other, 2), shown);
}

}  // namespace
}  // namespace palpate::protocols
