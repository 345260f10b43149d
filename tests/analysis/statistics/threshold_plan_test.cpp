// Power for a difference of JNDs, against studies of what is drawn directly: log ratios that are
// normal about the true one. Other measures by their level and truth.

#include "analysis/statistics/threshold_plan.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/students_t.hpp>
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

TEST(ThresholdPlan, MeasuredJndsGiveThePlanOfTrueRatios) {
  for (const double ratio : {0.8, 1.0}) {
    ThresholdStudy study;
    study.effect = std::log(ratio);
    const ThresholdPlan plan = plan_thresholds(study, asked(kManyTrials, {6}, 100));
    ASSERT_EQ(plan.powers.size(), 1U);
    const ThresholdPower& power = plan.powers[0];
    EXPECT_EQ(power.trials, kManyTrials);
    EXPECT_EQ(power.participants, 6U);
    EXPECT_EQ(power.studies, 100U);
    EXPECT_EQ(power.undetermined, 0U);
    EXPECT_DOUBLE_EQ(power.power, static_cast<double>(power.found) / 100);
    const double expected = power_of_six(std::log(ratio));
    EXPECT_NEAR(power.power, expected, 4 * std::sqrt(expected * (1 - expected) / 100)) << ratio;
    EXPECT_NEAR(power.se, std::sqrt(power.power * (1 - power.power) / 100), 1e-12);
    EXPECT_LT(power.ci95.low, power.power);
    EXPECT_GT(power.ci95.high, power.power);
    // The mean of 100 means of six: sd 0.2 / sqrt(600).
    EXPECT_NEAR(power.bias, 0, 4 * 0.2 / std::sqrt(600)) << ratio;
  }
}

// The more participants are the fewer and some more: a study of four is the first four of twelve.
TEST(ThresholdPlan, MoreParticipantsFindMore) {
  ThresholdStudy study;
  study.effect = std::log(0.6);
  ThresholdPlanSettings settings = asked(84, {1, 4, 12}, 20);
  std::vector<double> shares;
  settings.progress = [&shares](double share) { shares.push_back(share); };
  const ThresholdPlan plan = plan_thresholds(study, settings);
  ASSERT_EQ(plan.powers.size(), 3U);
  EXPECT_EQ(plan.powers[0].power, 0) << "of one participant nothing is concluded";
  EXPECT_EQ(plan.powers[0].undetermined, 20U);
  EXPECT_GT(plan.powers[2].power, plan.powers[1].power);
  settings = asked(84, {4}, 20);
  settings.jobs = 3;
  const ThresholdPlan few = plan_thresholds(study, settings);
  EXPECT_EQ(few.powers[0].found, plan.powers[1].found);
  EXPECT_EQ(few.powers[0].bias, plan.powers[1].bias);
  ASSERT_EQ(shares.size(), 20U);
  EXPECT_DOUBLE_EQ(shares.back(), 1);
}

TEST(ThresholdPlan, ShiftsAndThresholdsAreFound) {
  ThresholdStudy study;
  study.measure = PlannedMeasure::pse;
  study.effect = 1.5;
  const ThresholdPower pse = plan_thresholds(study, asked(84, {8}, 20)).powers[0];
  EXPECT_GE(pse.found, 18U);
  EXPECT_NEAR(pse.bias, 0, 0.15);
  study.measure = PlannedMeasure::threshold;
  study.effect = std::log(0.5);
  const ThresholdPower threshold = plan_thresholds(study, asked(84, {8}, 20)).powers[0];
  EXPECT_GE(threshold.found, 17U);
  EXPECT_NEAR(threshold.bias, 0, 0.15);
}

TEST(ThresholdPlan, SharesAndRatingsKeepTheirLevelAndTruth) {
  for (const PlannedMeasure measure : {PlannedMeasure::accuracy, PlannedMeasure::rating}) {
    ThresholdStudy study;
    study.measure = measure;
    study.participant_sd = 0.7;
    study.effect_sd = 0.5;
    study.effect = 0;
    const ThresholdPower none = plan_thresholds(study, asked(40, {8}, 1000)).powers[0];
    EXPECT_NEAR(none.power, 0.05, 4 * std::sqrt(0.05 * 0.95 / 1000));
    EXPECT_NEAR(none.bias, 0, 0.03);
    study.effect = measure == PlannedMeasure::accuracy ? 0.12 : 0.8;
    const ThresholdPower some = plan_thresholds(study, asked(40, {8}, 1000)).powers[0];
    EXPECT_GT(some.power, 0.5);
    EXPECT_NEAR(some.bias, 0, 0.04);
    EXPECT_LT(some.undetermined, 10U);
  }
}

// Two one-sided tests of six people, D = 1.5 SD of differences: 86 %.
TEST(ThresholdPlan, EquivalenceNeedsAWideBound) {
  ThresholdStudy study;
  study.measure = PlannedMeasure::rating;
  study.effect = 0;
  study.effect_sd = 1;
  study.participant_sd = 0;
  study.rating_sd = 0.01;
  study.bound = 2;
  const double wide = plan_thresholds(study, asked(500, {6}, 400)).powers[0].power;
  study.bound = 0.2;
  const double narrow = plan_thresholds(study, asked(500, {6}, 400)).powers[0].power;
  EXPECT_GT(wide, 0.8);
  EXPECT_LT(narrow, 0.1);
}

/// Power in the right direction of a two-sided t test at 5 %. \param noncentrality  of t
double power_of_t(double noncentrality, double df) {
  const double critical = quantile(boost::math::students_t(df), 0.975);
  return cdf(complement(boost::math::non_central_t(df, std::abs(noncentrality)), critical));
}

ThresholdStudy of_movements(PlannedMeasure measure, PlannedContrast contrast) {
  ThresholdStudy study;
  study.measure = measure;
  study.contrast = contrast;
  study.effect = measure == PlannedMeasure::adaptation ? 0.2 : -0.003;
  study.effect_sd = 0.8 * std::abs(study.effect);
  study.participant_sd = 1.1 * std::abs(study.effect);
  study.movement_sd = 2 * std::abs(study.effect);
  return study;
}

constexpr PlannedContrast kContrasts[] = {PlannedContrast::conditions, PlannedContrast::groups,
                                          PlannedContrast::zero};

// The power of t, of which the variance of a participant's figure has a closed form.
TEST(ThresholdPlan, MovementsHaveThePowerOfT) {
  constexpr std::size_t kPeople = 14, kTrials = 8, kStudies = 2000;
  for (const PlannedMeasure measure :
       {PlannedMeasure::deviation, PlannedMeasure::aftereffect, PlannedMeasure::adaptation}) {
    for (const PlannedContrast contrast : kContrasts) {
      const ThresholdStudy study = of_movements(measure, contrast);
      const bool paired = contrast == PlannedContrast::conditions;
      const bool groups = contrast == PlannedContrast::groups;
      const double own = paired ? study.effect_sd : study.participant_sd;
      const double figure_sd = std::hypot(
          own, study.movement_sd * std::sqrt((paired ? 2.0 : 1.0) / static_cast<double>(kTrials)));
      const double se = figure_sd * std::sqrt((groups ? 4.0 : 1.0) / static_cast<double>(kPeople));
      const double expected =
          power_of_t(study.effect / se, static_cast<double>(kPeople - (groups ? 2 : 1)));
      const ThresholdPower found =
          plan_thresholds(study, asked(kTrials, {kPeople}, kStudies)).powers[0];
      EXPECT_NEAR(found.power, expected, 4 * std::sqrt(expected * (1 - expected) / kStudies))
          << static_cast<int>(measure) << " " << static_cast<int>(contrast);
      EXPECT_NEAR(found.bias, 0, 4 * se / std::sqrt(kStudies));
      EXPECT_EQ(found.undetermined, 0U);
    }
  }
}

// Without an effect p is uniform, so a share of alpha finds one, at any alpha.
TEST(ThresholdPlan, MovementsWithoutEffectHaveUniformP) {
  constexpr std::size_t kStudies = 2000;
  for (const PlannedContrast contrast : kContrasts) {
    ThresholdStudy study = of_movements(PlannedMeasure::adaptation, contrast);
    study.effect = 0;
    for (const double alpha : {0.01, 0.05, 0.2, 0.5}) {
      study.alpha = alpha;
      const double power = plan_thresholds(study, asked(5, {9}, kStudies)).powers[0].power;
      EXPECT_NEAR(power, alpha, 4 * std::sqrt(alpha * (1 - alpha) / kStudies))
          << static_cast<int>(contrast);
    }
  }
}

}  // namespace
}  // namespace palpate::analysis
