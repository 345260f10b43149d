// Psychometric fits of simulated studies: coverage of their intervals, refits, goodness of fit.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/psychometric_likelihood.h"
#include "data/base/random.h"
#include "tests/shared/rounds.h"

namespace palpate::analysis {
namespace {

using protocols::PsychometricShape;

/// A simulated study of constant stimuli.
std::vector<LevelCount> simulate_counts(const PsychometricModel& truth,
                                        const protocols::PsychometricParameters& parameters,
                                        Random& random) {
  std::vector<LevelCount> counts;
  for (int level = 0; level <= 8; ++level) {
    LevelCount count{static_cast<double>(level), 30, 0};
    const double p = psychometric_probability(truth.function, parameters, level);
    for (int i = 0; i < count.trials; ++i) count.successes += random.unit() < p ? 1 : 0;
    counts.push_back(count);
  }
  return counts;
}

bool holds(const Interval& interval, double value) {
  return interval.low <= value && value <= interval.high;
}

TEST(PsychometricFit, IntervalsCoverTheTruthIn200SimulatedStudies) {
  const int studies = palpate::testing::rounds(100);  // for each of two seeds
  struct Case {
    const char* name;
    PsychometricModel model;
    protocols::PsychometricParameters truth;
  };
  const Case cases[] = {
      {"yes/no", {}, {4, 1.2, 0, 0}},
      // As `analyze` fits them.
      {"yes/no, lapses free", {{}, {}, {0, true, 0.06}}, {4, 1.2, 0, 0.02}},
      {"2AFC, lapses free",
       {{PsychometricShape::normal}, {0.5, false, 0.1}, {0, true, 0.06}},
       {4, 0.7, 0.5, 0.03}},
      {"both sides, lapses free", {{}, {}, {0, true, 0.06}, true}, {4, 1.2, 0.05, 0.05}},
  };
  for (const Case& one : cases) {
    int thresholds = 0, slopes = 0, lapses = 0;
    int bayes_thresholds = 0, bayes_slopes = 0, bayes_lapses = 0;
    for (const std::uint64_t seed : {1U, 2U}) {
      Random random(seed, {0xc0});
      int threshold = 0, slope = 0, lapse = 0;
      int bayes_threshold = 0, bayes_slope = 0, bayes_lapse = 0;
      for (int study = 0; study < studies; ++study) {
        const auto counts = simulate_counts(one.model, one.truth, random);
        const PsychometricFit fit = fit_psychometric(counts, one.model);
        ASSERT_EQ(fit.undefined, "");
        threshold += holds(fit.threshold_ci95, one.truth.threshold) ? 1 : 0;
        slope += holds(fit.slope_ci95, one.truth.slope) ? 1 : 0;
        lapse += holds(fit.lapse_ci95, one.truth.lapse) ? 1 : 0;
        const PsychometricPosterior posterior = psychometric_posterior(counts, one.model);
        bayes_threshold += holds(posterior.threshold_ci95, one.truth.threshold) ? 1 : 0;
        bayes_slope += holds(posterior.slope_ci95, one.truth.slope) ? 1 : 0;
        bayes_lapse += holds(posterior.lapse_ci95, one.truth.lapse) ? 1 : 0;
      }
      std::printf(
          "%s, seed %llu: intervals hold threshold %d, slope (JND) %d, lapse %d; Bayes %d, %d, "
          "%d\n",
          one.name, static_cast<unsigned long long>(seed), threshold, slope, lapse, bayes_threshold,
          bayes_slope, bayes_lapse);
      thresholds += threshold;
      slopes += slope;
      lapses += lapse;
      bayes_thresholds += bayes_threshold;
      bayes_slopes += bayes_slope;
      bayes_lapses += bayes_lapse;
    }
    // Within three standard deviations of the number that is expected.
    const double expected = 0.95 * 2 * studies, three_sd = 3 * std::sqrt(0.05 * expected);
    for (const int covered :
         {thresholds, slopes, lapses, bayes_thresholds, bayes_slopes, bayes_lapses})
      EXPECT_GE(covered, expected - three_sd) << one.name;
    for (const int covered : {thresholds, slopes})
      EXPECT_LE(covered, expected + three_sd) << one.name;
  }
}

// Where the lower end is held at 0, the fit is bad and the JND too large.
TEST(PsychometricFit, LapsesAtBothEndsAreNoBadFit) {
  PsychometricModel both{{}, {}, {0, true, 0.06}, true}, upper_only{{}, {}, {0, true, 0.06}};
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed, {0xc2});
  constexpr int kStudies = 40;
  int bad = 0, bad_upper = 0;
  double ratio = 0, ratio_upper = 0;
  for (int i = 0; i < kStudies; ++i) {
    const auto counts = simulate_counts({}, {4, 1.2, 0.05, 0.05}, random);
    for (const bool shared : {true, false}) {
      const PsychometricModel& model = shared ? both : upper_only;
      const PsychometricFit fit = fit_psychometric(counts, model);
      (shared ? bad : bad_upper) +=
          *goodness_of_fit(counts, model, fit, 99, random.next()).p <= 0.05 ? 1 : 0;
      (shared ? ratio : ratio_upper) += 1.2 / fit.parameters.slope / kStudies;
    }
  }
  EXPECT_LE(bad, 2 + 3 * std::sqrt(2));
  EXPECT_GT(bad_upper, bad);
  EXPECT_NEAR(ratio, 1, 0.06);
  EXPECT_GT(ratio_upper, 1.15) << "JND, of the true one";
}

/// Minus log likelihood of the best fit that a search finds.
double least_loss(const std::vector<LevelCount>& counts, const PsychometricModel& model,
                  const PsychometricSearch& search) {
  const PlacedData data = place_counts(counts, model.function);
  return PsychometricObjective(data, model).best(search, 1e-11).value;
}

TEST(PsychometricFit, QuickRefitsGiveTheGoodnessOfWholeOnes) {
  PsychometricModel model;
  model.function.shape = PsychometricShape::normal;
  model.guess.value = 0.5;
  model.lapse = {0, true, 0.06};
  const protocols::PsychometricParameters truth{4, 0.7, 0.5, 0.03};
  constexpr int kRefits = 2000;
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed, {0xc1});
    std::vector<double> quick, whole;  // deviances
    int missed = 0;                    // the whole search ends in a worse valley than the quick one
    for (int i = 0; i < kRefits; ++i) {
      const auto counts = simulate_counts(model, truth, random);
      double saturated = 0;
      for (const LevelCount& count : counts) {
        const double n = count.trials, k = count.successes;
        if (k > 0) saturated += k * std::log(k / n);
        if (k < n) saturated += (n - k) * std::log(1 - k / n);
      }
      quick.push_back(2 * (saturated + least_loss(counts, model, kQuickSearch)));
      whole.push_back(2 * (saturated + least_loss(counts, model, kWholeSearch)));
      missed += quick.back() < whole.back() - 1e-6 ? 1 : 0;
    }
    // Shares that are at least as large as any deviance: what p is.
    std::sort(quick.begin(), quick.end());
    std::sort(whole.begin(), whole.end());
    double most = 0;
    for (const double deviance : whole) {
      const auto above = [&](const std::vector<double>& all) {
        return static_cast<double>(all.end() - std::lower_bound(all.begin(), all.end(), deviance)) /
               kRefits;
      };
      most = std::max(most, std::abs(above(quick) - above(whole)));
    }
    std::printf("seed %llu: p of quick and of whole refits differ by %.4f at most; %d missed\n",
                static_cast<unsigned long long>(seed), most, missed);
    EXPECT_EQ(missed, 0);
    // The noise of 199 refits is 0.035 at p = 0.5 and 0.015 at p = 0.05.
    EXPECT_LT(most, 0.015);
  }
}

TEST(PsychometricFit, DeviancePIsUniformExceptForWrongModels) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  int below_fifth = 0;
  for (int study = 0; study < 60; ++study) {
    const auto counts = simulate_counts({}, {4, 1.2, 0, 0}, random);
    const PsychometricFit fit = fit_psychometric(counts, {});
    const GoodnessOfFit good = goodness_of_fit(counts, {}, fit, 99, 7);
    EXPECT_EQ(good.levels, 9);
    below_fifth += *good.p <= 0.2 ? 1 : 0;
  }
  EXPECT_NEAR(below_fifth, 12, 4 * std::sqrt(60 * 0.2 * 0.8));
  // Answers that rise and fall again are no function of this kind.
  const std::vector<LevelCount> bent{{0, 30, 1}, {2, 30, 28}, {4, 30, 4}, {6, 30, 27}, {8, 30, 29}};
  EXPECT_LT(*goodness_of_fit(bent, {}, fit_psychometric(bent, {}), 199, 7).p, 0.02);
}

}  // namespace
}  // namespace palpate::analysis
