#include "protocols/procedures/recovery.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace palpate::protocols {
namespace {

// Yes/no with a logistic function of spread 1 and threshold 20, as units of the level.
const PsychometricParticipant kYesNo{{}, {20, 2}};
// Two-interval forced choice, Weibull over dB, slope 3.5, lapse 0.02: Watson 2017's examples.
const PsychometricParticipant kForcedChoice{{PsychometricShape::weibull, LevelScale::decibel},
                                            {0.1, 3.5, 0.5, 0.02}};

Recovery print(const std::string& name, const ProcedureSpec& spec,
               const PsychometricParticipant& participant, std::uint64_t seed) {
  const Recovery r = simulate_recovery(spec, participant, 200, seed);
  std::printf("seed %llu  %-34s %6.1f trials  bias %7.3f +- %.3f  spread %.3f  without %d\n",
              static_cast<unsigned long long>(seed), name.c_str(), r.mean_trials, r.bias, r.bias_se,
              r.spread, r.without_estimate);
  return r;
}

Staircase yes_no_staircase(double target) {
  Staircase spec;
  spec.start = 24;
  spec.steps = {2, 1, 0.5};
  spec.step_ratio = step_ratio_for(target, 1);
  spec.min = 0;
  spec.max = 40;
  spec.stop_reversals = 22;
  spec.discard_reversals = 6;
  return spec;
}

QuestPlus forced_choice_quest(int trials) {
  QuestPlus spec;
  spec.function = kForcedChoice.function;
  for (int i = 0; i < 41; ++i) spec.levels.push_back(level_at(LevelScale::decibel, -40 + i));
  spec.threshold.values = spec.levels;
  spec.slope.values = {2, 2.5, 3, 3.5, 4, 5};
  spec.guess.values = {0.5};
  spec.lapse.values = {0, 0.01, 0.02, 0.03, 0.04};
  spec.stop_trials = trials;
  return spec;
}

TEST(ProcedureRecovery, StaircasesFindTheirConvergencePoint) {
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const int down : {1, 2, 3}) {
      Staircase spec = yes_no_staircase(0.5);
      spec.down = down;
      const Recovery r = print("1-up-" + std::to_string(down) + "-down", spec, kYesNo, seed);
      EXPECT_EQ(r.without_estimate, 0);
      EXPECT_NEAR(r.bias, 0, 0.05 + 3 * r.bias_se);
      EXPECT_LT(r.spread, 0.3);
    }
  }
}

// Garcia-Perez 1998: in forced choice, these ratios make a staircase converge at the same share of
// successes for any step size; transformed and weighted staircases in general miss their targets.
TEST(ProcedureRecovery, GarciaPerezRatiosHardlyDependOnTheStep) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const double ratios[] = {0.2845, 0.5488, 0.7393, 0.8415};
    const double shares[] = {0.7785, 0.8035, 0.8315, 0.8584};
    for (const int down : {1, 2, 3, 4}) {
      for (const double step : {0.25, 0.5, 1.0}) {  // of a spread of 4 and more
        Staircase spec = yes_no_staircase(0.5);
        spec.start = 22;
        spec.down = down;
        spec.step_ratio = 1 / ratios[down - 1];
        spec.steps = {step};
        ASSERT_NEAR(convergence_point(spec), shares[down - 1], 1e-4);
        const PsychometricParticipant forced{{PsychometricShape::normal}, {20, 1, 0.5, 0}};
        spec.stop_reversals = 200;
        spec.stop_trials = 10000;
        spec.discard_reversals = 20;
        const Recovery r =
            print(std::to_string(down) + "-down, ratio of 1998, step " + std::to_string(step), spec,
                  forced, seed);
        EXPECT_NEAR(r.bias, 0, 0.15 * step + 3 * r.bias_se) << down;
      }
    }
  }
}

// The mean level of a staircase with 75 % successes on average is not the level of 75 %: the
// function is curved, and a weighted staircase spreads over its steps. So the bias depends on the
// step.
TEST(ProcedureRecovery, WeightedStaircasesAreBiasedByTheirSteps) {
  for (const std::uint64_t seed : {1U, 2U}) {
    double coarse = 0;
    for (const double step : {0.5, 0.25, 0.125}) {
      Staircase spec = yes_no_staircase(0.75);
      spec.steps = {2, 1, step};
      const Recovery r =
          print("weighted, 0.75, last step " + std::to_string(step), spec, kYesNo, seed);
      EXPECT_LT(std::abs(r.bias), step);
      if (step < 0.5) {
        EXPECT_LT(r.bias, 0.75 * coarse);
      }
      coarse = r.bias;
    }
  }
}

TEST(ProcedureRecovery, LimitsBiasIsBelowAStep) {
  Limits spec;
  spec.low = 14;
  spec.high = 26;
  spec.jitter_steps = 3;
  for (const std::uint64_t seed : {1U, 2U}) {
    const Recovery r = print("limits, 8 series", spec, kYesNo, seed);
    EXPECT_NEAR(r.bias, 0, 0.1 + 3 * r.bias_se);
    EXPECT_LT(r.spread, 0.5);
  }
}

/// Fisher's information of a trial on the threshold where it is greatest, 1/dB^2: no unbiased
/// procedure of n trials has a smaller spread than 1 / sqrt(n times this).
double best_information(const PsychometricParticipant& participant) {
  double best = 0;
  for (double place = -40; place < 0; place += 0.1) {
    const auto p = [&](double shift) {
      return psychometric_probability(participant.function, participant.parameters,
                                      level_at(LevelScale::decibel, place + shift));
    };
    const double rise = (p(0.01) - p(-0.01)) / 0.02;
    best = std::max(best, rise * rise / (p(0) * (1 - p(0))));
  }
  return best;
}

TEST(ProcedureRecovery, QuestPlusOfTheThresholdAloneIsEfficient) {
  for (const std::uint64_t seed : {1U, 2U}) {
    QuestPlus spec = forced_choice_quest(128);
    spec.slope.values = {3.5};
    spec.lapse.values = {0.02};
    const Recovery r = print("QUEST+, threshold alone", spec, kForcedChoice, seed);
    const double efficiency = 1 / (128 * best_information(kForcedChoice) * r.spread * r.spread);
    std::printf("        efficiency %.2f\n", efficiency);
    EXPECT_NEAR(r.bias, 0, 0.1 * r.spread + 3 * r.bias_se);
    // The first trials are spent on the search; the standard error of a variance over 200
    // participants is a tenth of it.
    EXPECT_GT(efficiency, 0.6);
    EXPECT_LT(efficiency, 1.2);
  }
}

TEST(ProcedureRecovery, QuestPlusGrowsMoreCertainWithItsTrials) {
  for (const std::uint64_t seed : {1U, 2U}) {
    double before = 100;
    for (const int trials : {32, 64, 128}) {
      const Recovery r =
          print("QUEST+, Weibull 2AFC", forced_choice_quest(trials), kForcedChoice, seed);
      // Means of skewed posteriors have a bias that is small compared with the spread.
      EXPECT_NEAR(r.bias, 0, 0.2 * r.spread + 3 * r.bias_se) << trials;
      EXPECT_LT(r.spread, 0.85 * before);  // ideally 1 / sqrt(2)
      before = r.spread;
    }
  }
}

TEST(ProcedureRecovery, ParticipantsWithoutEstimateAreCounted) {
  Staircase spec = yes_no_staircase(0.5);
  const PsychometricParticipant never{{}, {1000, 2}};
  const Recovery r = simulate_recovery(spec, never, 20, 1);
  EXPECT_EQ(r.without_estimate, 20);
  EXPECT_EQ(r.mean_trials, 200);
}

}  // namespace
}  // namespace palpate::protocols
