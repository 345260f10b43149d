// Edge cases of the definitions; all other values are compared with R in oracle_test.

#include "analysis/statistics/describe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {
namespace {

TrialTable table_of(const std::vector<StudyTrial>& trials) {
  TrialTableBuilder builder;
  int number = 0;
  for (StudyTrial trial : trials) {
    trial.participant = "P1";
    trial.renderer = "ray";
    trial.shape = "cone";
    trial.trial = ++number;
    builder.add(trial);
  }
  return builder.finish({});
}

StudyTrial answered(const char* response, double time) {
  StudyTrial trial;
  trial.response = response;
  trial.correct = trial.response == "cone";
  trial.response_time = time;
  return trial;
}

StudyTrial time_out() {
  StudyTrial trial = answered("", 60);
  trial.timed_out = true;
  return trial;
}

TEST(Describe, TheLimitItselfIsKept) {
  const Description found = describe(
      table_of({answered("cone", 0.2), answered("cone", 0.19999999999999998), answered("cone", 3)}),
      0.2);
  EXPECT_EQ(found.counts.n_used_for_times, 2U);
  EXPECT_EQ(found.counts.n_too_fast, 1U);
  EXPECT_EQ(found.times[0][0].mean_of_participant_means, 1.6);
  EXPECT_EQ(found.counts.n_correct, 3U) << "an anticipation counts for accuracy";
}

TEST(Describe, TimeOutsAreWrongAndNoResponse) {
  StudyTrial claims = time_out();
  claims.correct = true;
  const Description found =
      describe(table_of({time_out(), claims, answered("cone", 2), answered("cube", 0.1)}), 0.2);
  const AccuracyCell& cell = found.accuracy[0][0];
  EXPECT_EQ(cell.n_correct, 1U);
  EXPECT_EQ(cell.accuracy, 0.25);
  EXPECT_EQ(cell.accuracy_answered, 0.5);
  EXPECT_EQ(found.counts.n_timeouts, 2U);
  EXPECT_EQ(found.counts.n_too_fast, 1U) << "answered too fast, right or wrong";
  EXPECT_EQ(found.confusion[0][0], (std::vector<std::size_t>{1, 1, 2}));
}

TEST(Describe, NothingAnsweredLeavesNoShareOfIt) {
  const Description found = describe(table_of({time_out()}), 0.2);
  EXPECT_EQ(found.accuracy[0][0].accuracy, 0.0);
  EXPECT_FALSE(found.accuracy[0][0].accuracy_answered.has_value());
  EXPECT_FALSE(found.times[0][0].mean_of_participant_means.has_value());
}

TEST(Median, LiesBetweenTheMiddleTwoOfEvenCounts) {
  std::vector<double> four{9, 1, 4, 2}, three{9, 1, 4}, one{7};
  EXPECT_EQ(median(four), 3);
  EXPECT_EQ(median(three), 4);
  EXPECT_EQ(median(one), 7);
}

TEST(StandardDeviation, DividesByOneLess) {
  EXPECT_DOUBLE_EQ(standard_deviation({1, 3}).value(), std::sqrt(2.0));
  EXPECT_FALSE(standard_deviation({1}).has_value());
}

}  // namespace
}  // namespace palpate::analysis
