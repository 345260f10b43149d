// Simulated studies of the group's model: its level in the hardest case, and its tallies.

#include "analysis/statistics/group_simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <vector>

namespace palpate::analysis {
namespace {

// 200 studies: a standard error of 1.5 points at 5 %. A method that treats fits as known has 15 to
// 19 % here.
TEST(GroupSimulation, HardestCaseKeepsTheLevel) {
  GroupCoverageSettings settings;
  settings.seed = 11;
  settings.means = settings.intervals = false;
  const GroupCoverage found = group_coverage({hardest_group_study()}, settings)[0];
  ASSERT_EQ(found.location_difference.results, 200U);
  std::cout << "significant of 200: locations " << found.location_difference.found << ", widths "
            << found.log_width_difference.found << "\n";
  EXPECT_LE(found.location_difference.found, 18U);
  EXPECT_LE(found.log_width_difference.found, 18U);
}

TEST(GroupSimulation, JobsDoNotChangeTheResult) {
  GroupCoverageSettings settings;
  settings.studies = 3;
  const GroupStudy study = group_coverage_studies()[1];
  const GroupCoverage one = group_coverage({study}, settings)[0];
  settings.jobs = 3;
  const GroupCoverage three = group_coverage({study}, settings)[0];
  EXPECT_EQ(one.studies, 3U);
  EXPECT_EQ(one.log_width.results, 6U);
  EXPECT_EQ(one.log_width.error, three.log_width.error);
  EXPECT_EQ(one.location_difference.error, three.location_difference.error);
}

TEST(GroupSimulation, DifferencesOfTheTruthAreFound) {
  GroupStudy study = group_coverage_studies()[3];
  study.log_ratio = -0.9;
  study.location_difference = 60;
  GroupCoverageSettings settings;
  settings.studies = 4;
  settings.means = false;
  const GroupCoverage found = group_coverage({study}, settings)[0];
  EXPECT_EQ(found.log_width_difference.found, 4U);
  EXPECT_EQ(found.location_difference.found, 4U);
  EXPECT_NEAR(found.location_difference.bias(), 0, 8);
  EXPECT_NEAR(found.log_width_difference.bias(), 0, 0.25);
}

TEST(GroupSimulation, ParticipantsHaveTheTrialsOfTheirProcedure) {
  for (const GroupStudy& study : group_coverage_studies()) {
    const auto answers = simulated_answers(study, 3, 0);
    ASSERT_EQ(answers.size(), 2U);
    ASSERT_EQ(answers[1].size(), study.participants);
    int trials = 0;
    for (const LevelCount& count : answers[1][0].counts) trials += count.trials;
    EXPECT_TRUE(trials == 42 || trials == 84 || trials == 168) << study.name;
    EXPECT_EQ(answers[0][0].catch_trials, study.catch_trials);
  }
}

}  // namespace
}  // namespace palpate::analysis
