#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"

namespace palpate::protocols {
namespace {

/// 1-up-1-down from 10 in steps of 1 between 0 and 20.
Staircase simple_staircase() {
  Staircase spec;
  spec.start = 10;
  spec.steps = {1};
  spec.min = 0;
  spec.max = 20;
  spec.stop_trials = 1000;
  return spec;
}

/// Levels of a staircase whose answers are written as '+' and '-'.
std::vector<double> levels_after(StaircaseRun& run, const std::string& answers) {
  std::vector<double> levels;
  for (const char answer : answers) {
    const auto level = run.next_level();
    if (!level) break;
    levels.push_back(*level);
    run.record({*level, answer == '+'});
  }
  return levels;
}

TEST(Staircase, OneUpOneDown) {
  StaircaseRun run(simple_staircase());
  EXPECT_EQ(levels_after(run, "++--+"), (std::vector<double>{10, 9, 8, 9, 10}));
  EXPECT_EQ(run.reversal_levels(), (std::vector<double>{8, 10}));
}

TEST(Staircase, CountsAnswersInARow) {
  Staircase spec = simple_staircase();
  spec.down = 3;
  spec.up = 2;
  StaircaseRun run(spec);
  EXPECT_EQ(levels_after(run, "++-+++--+++"),
            (std::vector<double>{10, 10, 10, 10, 10, 10, 9, 9, 10, 10, 10}));
  EXPECT_EQ(run.next_level(), 9);
}

TEST(Staircase, StepsShrinkWithTheReversals) {
  Staircase spec = simple_staircase();
  spec.steps = {4, 2, 1};
  StaircaseRun run(spec);
  // 10 -4-> 6; turns there: +2 -> 8, +2 -> 10; turns: -1 -> 9.
  EXPECT_EQ(levels_after(run, "+--+"), (std::vector<double>{10, 6, 8, 10}));
  EXPECT_EQ(run.next_level(), 9);
}

TEST(Staircase, WeightedStepsAndLowerIsEasier) {
  Staircase spec = simple_staircase();
  spec.step_ratio = 3;
  spec.easier = Easier::lower;
  StaircaseRun run(spec);
  EXPECT_EQ(levels_after(run, "++-"), (std::vector<double>{10, 11, 12}));
  EXPECT_EQ(run.next_level(), 9);
}

TEST(Staircase, StaysWithinItsRangeAndSaysSo) {
  Staircase spec = simple_staircase();
  spec.scale = LevelScale::log10;
  spec.min = 0.3;
  spec.max = 30;
  StaircaseRun run(spec);
  EXPECT_EQ(levels_after(run, "--+"), (std::vector<double>{10, 30, 30}));
  EXPECT_EQ(run.estimate().at_limit, 2);
  EXPECT_EQ(run.next_level(), 3);
}

TEST(Staircase, EndsWithReversalsOrTrials) {
  Staircase spec = simple_staircase();
  spec.stop_reversals = 2;
  StaircaseRun reversed(spec);
  EXPECT_EQ(levels_after(reversed, "+-+-+-").size(), 3u);
  spec.stop_trials = 2;
  StaircaseRun short_one(spec);
  EXPECT_EQ(levels_after(short_one, "+-+-+-").size(), 2u);
  EXPECT_EQ(short_one.next_level(), std::nullopt);
}

TEST(Staircase, EstimateBalancesPeaksAndValleys) {
  Staircase spec = simple_staircase();
  spec.discard_reversals = 1;
  StaircaseRun run(spec);
  levels_after(run, "+-");
  EXPECT_EQ(run.estimate().threshold, std::nullopt);
  levels_after(run, "-+++--");
  // Reversals 9, 11, 8: the first is discarded.
  ASSERT_EQ(run.reversal_levels(), (std::vector<double>{9, 11, 8}));
  EXPECT_EQ(run.estimate().threshold, 9.5);
  levels_after(run, "+");
  // A fourth reversal, 10: of the remaining three the first is left out.
  ASSERT_EQ(run.reversal_levels().back(), 10);
  EXPECT_EQ(run.estimate().threshold, 9);
}

TEST(Staircase, ContinuesFromALevelOfAnotherProgram) {
  StaircaseRun run(simple_staircase());
  run.record({15, true});
  EXPECT_EQ(run.next_level(), 14);
}

TEST(Staircase, ConvergencePointsOfTheLiterature) {
  Staircase spec = simple_staircase();
  const auto point = [&](int up, int down, double ratio) {
    spec.up = up;
    spec.down = down;
    spec.step_ratio = ratio;
    return convergence_point(spec);
  };
  // Levitt 1971, table I: 0.5^(1/down).
  EXPECT_NEAR(point(1, 1, 1), 0.5, 1e-12);
  EXPECT_NEAR(point(1, 2, 1), 0.7071, 5e-5);
  EXPECT_NEAR(point(1, 3, 1), 0.7937, 5e-5);
  EXPECT_NEAR(point(1, 4, 1), 0.8409, 5e-5);
  EXPECT_NEAR(point(2, 1, 1), 0.2929, 5e-5);
  EXPECT_NEAR(point(2, 2, 1), 0.5, 1e-12);
  // Kaernbach 1991: S_up p_failure = S_down p_success.
  EXPECT_NEAR(point(1, 1, 3), 0.75, 1e-12);
  EXPECT_NEAR(point(1, 1, step_ratio_for(0.9, 1)), 0.9, 1e-12);
  EXPECT_NEAR(point(1, 3, step_ratio_for(0.8, 3)), 0.8, 1e-12);
}

/// Share of successes over a long run of a staircase.
double share_of_successes(Staircase spec, std::uint64_t seed) {
  const PsychometricParticipant participant{{}, {10, 0.4}};
  spec.stop_trials = 200000;
  Random random(seed);
  StaircaseRun run(spec);
  double sum = 0;
  while (const auto level = run.next_level()) {
    sum += psychometric_probability(participant.function, participant.parameters, *level);
    run.record({*level, participant.succeeds(*level, random)});
  }
  return sum / spec.stop_trials;
}

TEST(Staircase, ALongRunHoversAboutItsConvergencePoint) {
  Staircase spec = simple_staircase();
  spec.steps = {0.25};
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const double target : {0.5, 0.7, 0.8}) {
      spec.step_ratio = step_ratio_for(target, 1);
      EXPECT_NEAR(share_of_successes(spec, seed), target, 0.01) << target;
    }
    Staircase transformed = spec;
    transformed.step_ratio = 1;
    transformed.down = 2;
    EXPECT_NEAR(share_of_successes(transformed, seed), convergence_point(transformed), 0.01);
  }
}

TEST(ExpectedTrials, FollowTheCourseOfAStaircase) {
  Staircase spec = simple_staircase();
  spec.stop_trials = 200;
  spec.stop_reversals = 8;
  spec.discard_reversals = 2;
  spec.down = 2;
  const Procedure fresh(spec, 1);
  const double all = expected_trials(spec, fresh);
  EXPECT_GT(all, 15);
  EXPECT_LT(all, 80);
  // A participant with a steep function half way to the hard end takes about as many.
  Procedure course = fresh;
  int trials = 0;
  while (const auto level = course.next_level()) {
    course.record({*level, *level > 5});
    ++trials;
    EXPECT_LE(expected_trials(spec, course), 200 - trials);
  }
  EXPECT_GT(all, 0.5 * trials);
  EXPECT_LT(all, 2.5 * trials);
  EXPECT_EQ(expected_trials(spec, course), 0);
}

TEST(ExpectedTrials, AreExactForAFixedNumber) {
  Staircase spec = simple_staircase();
  spec.stop_trials = 30;
  Procedure run(spec, 1);
  EXPECT_EQ(expected_trials(spec, run), 30);
  run.record({10, true});
  EXPECT_EQ(expected_trials(spec, run), 29);
}

}  // namespace
}  // namespace palpate::protocols
