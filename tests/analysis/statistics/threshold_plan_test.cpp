// Power for a difference of JNDs, against studies of what is drawn directly: log ratios that are
// normal about the true one.

#include "analysis/statistics/threshold_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kManyTrials = 7 * 3000;  // a JND is known to some 1 %

ThresholdPlanSettings asked(std::size_t trials, std::vector<std::size_t> participants,
                            std::size_t studies) {
  ThresholdPlanSettings settings;
  settings.trials = {trials};
  settings.participants = std::move(participants);
  settings.studies = studies;
  return settings;
}

/// Share of studies of six whose one-sample t test finds a mean of `mean`, sd 0.2, two-sided 5 %.
double power_of_six(double mean) {
  constexpr int kStudies = 20000, kPeople = 6;
  constexpr double kCritical = 2.570582;  // t, 5 degrees of freedom
  constexpr std::uint64_t kSeed = 77;
  Random random(kSeed);
  int found = 0;
  for (int s = 0; s < kStudies; ++s) {
    double sum = 0, squares = 0;
    for (int i = 0; i < kPeople; ++i) {
      const double x = mean + 0.2 * random.normal();
      sum += x;
      squares += x * x;
    }
    const double variance = (squares - sum * sum / kPeople) / (kPeople - 1);
    found += std::abs(sum / kPeople) > kCritical * std::sqrt(variance / kPeople) ? 1 : 0;
  }
  return static_cast<double>(found) / kStudies;
}

TEST(ThresholdPlan, OfMeasuredJndsIsThatOfTheirTrueRatios) {
  for (const double ratio : {0.8, 1.25, 1.0}) {
    ThresholdStudy study;
    study.ratio = ratio;
    const ThresholdPlan plan = plan_thresholds(study, asked(kManyTrials, {6}, 150));
    ASSERT_EQ(plan.powers.size(), 1U);
    const ThresholdPower& power = plan.powers[0];
    EXPECT_EQ(power.trials, kManyTrials);
    EXPECT_EQ(power.participants, 6U);
    EXPECT_EQ(power.studies, 150U);
    EXPECT_LE(power.undetermined, 150U * 6 * 2 / 20);
    EXPECT_DOUBLE_EQ(power.power, static_cast<double>(power.found) / 150);
    const double expected = power_of_six(std::log(ratio));
    EXPECT_NEAR(power.power, expected, 4 * std::sqrt(expected * (1 - expected) / 150)) << ratio;
    EXPECT_LT(power.ci95.low, power.power);
    EXPECT_GT(power.ci95.high, power.power);
    // The mean of 150 means of six: sd 0.2 / 30.
    EXPECT_NEAR(power.bias, 0, 4 * 0.2 / 30) << ratio;
    EXPECT_NEAR(power.coverage, 0.95, 4 * std::sqrt(0.95 * 0.05 / 150)) << ratio;
  }
}

// The more participants are the fewer and some more: a study of four is the first four of twelve.
TEST(ThresholdPlan, MoreParticipantsAndMoreTrialsFindMore) {
  ThresholdPlanSettings settings = asked(70, {1, 4, 12}, 40);
  settings.trials.push_back(280);
  std::vector<double> shares;
  settings.progress = [&shares](double share) { shares.push_back(share); };
  const ThresholdPlan plan = plan_thresholds({}, settings);
  ASSERT_EQ(plan.powers.size(), 6U);
  const auto at = [&plan](std::size_t trials, std::size_t participants) -> const ThresholdPower& {
    return plan.powers[trials * 3 + participants];
  };
  for (std::size_t t = 0; t < 2; ++t) {
    EXPECT_EQ(at(t, 0).power, 0) << "of one participant nothing is concluded";
    EXPECT_EQ(at(t, 0).bias, 0);
    EXPECT_EQ(at(t, 0).coverage, 0);
    EXPECT_EQ(at(t, 0).studies, 40U);
    EXPECT_GT(at(t, 2).power, at(t, 1).power);
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(at(t, n).trials, t == 0 ? 70U : 280U);
    EXPECT_LE(at(t, 1).undetermined, at(t, 2).undetermined);
  }
  EXPECT_GT(at(1, 1).power + at(1, 2).power, at(0, 1).power + at(0, 2).power);
  EXPECT_GT(at(0, 2).undetermined, at(1, 2).undetermined);
  const ThresholdPlan few = plan_thresholds({}, asked(70, {4}, 40));
  EXPECT_EQ(few.powers[0].found, at(0, 1).found);
  EXPECT_EQ(few.powers[0].bias, at(0, 1).bias);
  ASSERT_EQ(shares.size(), 80U);
  for (std::size_t i = 0; i < shares.size(); ++i)
    EXPECT_DOUBLE_EQ(shares[i], static_cast<double>(i + 1) / 80);
}

}  // namespace
}  // namespace palpate::analysis
