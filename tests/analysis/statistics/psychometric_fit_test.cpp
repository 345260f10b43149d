// Psychometric fits against R (glm, psyphy's links, optim on the definition), and what their
// intervals cover.

#include "analysis/statistics/psychometric_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "analysis/statistics/discrimination.h"

namespace palpate::analysis {
namespace {

using protocols::Easier;
using protocols::LevelScale;
using protocols::PsychometricShape;
using PsychometricJson = nlohmann::json;

PsychometricJson psychophysics_fixture() {
  return PsychometricJson::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/psychophysics.json"));
}

PsychometricModel model_of(const PsychometricJson& one) {
  PsychometricModel model;
  const std::string shape = one["shape"];
  model.function.shape = shape == "logistic" ? PsychometricShape::logistic
                         : shape == "normal" ? PsychometricShape::normal
                                             : PsychometricShape::weibull;
  if (one["scale"] == "log") model.function.scale = LevelScale::log10;
  if (one.value("easier", "higher") == "lower") model.function.easier = Easier::lower;
  model.guess = {one["guess"], one["free_guess"], one.value("most", 0.1)};
  model.lapse = {one["lapse"], one["free_lapse"], one.value("most", 0.1)};
  return model;
}

std::vector<LevelCount> counts_of(const PsychometricJson& one) {
  std::vector<LevelCount> counts;
  for (std::size_t i = 0; i < one["levels"].size(); ++i)
    counts.push_back({one["levels"][i], one["n"][i], one["k"][i]});
  return counts;
}

TEST(PsychometricFit, AgreesWithR) {
  const PsychometricJson fixture = psychophysics_fixture();
  ASSERT_EQ(fixture["psychometric"].size(), 12u);
  for (const auto& one : fixture["psychometric"]) {
    SCOPED_TRACE(one["name"].get<std::string>());
    const PsychometricModel model = model_of(one);
    const auto counts = counts_of(one);
    const PsychometricFit fit = fit_psychometric(counts, model);
    ASSERT_EQ(fit.undefined, "");
    const double threshold = one["threshold"], slope = one["slope"];
    EXPECT_NEAR(fit.parameters.threshold / threshold, 1, 2e-5);
    EXPECT_NEAR(fit.parameters.slope / slope, 1, 1e-4);
    if (one.contains("deviance")) {
      const GoodnessOfFit good = goodness_of_fit(counts, model, fit, 0, 1);
      EXPECT_NEAR(good.deviance, one["deviance"].get<double>(), 1e-6);
    } else {
      EXPECT_NEAR(fit.log_likelihood, one["log_likelihood"].get<double>(), 1e-6);
    }
    const auto near = [&one](double value, const char* key) {
      if (one.contains(key) && one[key].is_number()) {
        EXPECT_NEAR(value / one[key].get<double>(), 1, 1e-3) << key;
      }
    };
    near(fit.threshold_ci95.low, "threshold_low");
    near(fit.threshold_ci95.high, "threshold_high");
    near(fit.slope_ci95.low, "slope_low");
    near(fit.slope_ci95.high, "slope_high");
    const auto rate_near = [&one](double value, const char* key) {
      if (one.contains(key) && one[key].is_number()) {
        EXPECT_NEAR(value, one[key].get<double>(), 1e-4) << key;
      }
    };
    rate_near(fit.lapse_ci95.low, "lapse_low");
    rate_near(fit.lapse_ci95.high, "lapse_high");
    rate_near(fit.guess_ci95.low, "guess_low");
    rate_near(fit.guess_ci95.high, "guess_high");
  }
}

TEST(PsychometricFit, AgreesWithPsignifit) {
  const auto cases = PsychometricJson::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/psignifit.json"));
  ASSERT_GE(cases.size(), 7U);
  for (const PsychometricJson& one : cases) {
    PsychometricModel model;
    if (one["shape"] == "normal") model.function.shape = PsychometricShape::normal;
    if (one["shape"] == "weibull") model.function = {PsychometricShape::weibull, LevelScale::log10};
    model.guess.value = one["guess"];
    model.lapse = {0, true, one["most_lapse"]};
    std::vector<LevelCount> counts;
    for (std::size_t i = 0; i < one["levels"].size(); ++i)
      counts.push_back({one["levels"][i], one["n"], one["k"][i]});
    const PsychometricFit fit = fit_psychometric(counts, model);
    const double threshold = one["threshold"], slope = one["slope"], lapse = one["lapse"];
    // Its search ends earlier than this one, and never lower; it prints six digits.
    const double deviance = goodness_of_fit(counts, model, fit, 0, 1).deviance;
    EXPECT_LE(deviance, one["deviance"].get<double>() + 1e-4) << one["name"];
    EXPECT_NEAR(deviance, one["deviance"].get<double>(), 5e-3) << one["name"];
    EXPECT_NEAR(fit.parameters.threshold, threshold, 2e-3 * threshold) << one["name"];
    EXPECT_NEAR(fit.parameters.slope, slope, 2e-2 * slope) << one["name"];
    EXPECT_NEAR(fit.parameters.lapse, lapse, 3e-3) << one["name"];
  }
}

/// Plain search of a grid within the bounds of the fit: lapses 0 to 0.06, guesses 0.5.
double least_of_grid(const std::vector<LevelCount>& counts, const PsychometricModel& model) {
  double least = 1e300;
  for (double threshold = 305; threshold <= 395; threshold += 0.5) {
    for (double slope = 0.005; slope < 2; slope *= 1.05) {
      for (double lapse = 0; lapse <= 0.0601; lapse += 0.006) {
        double loss = 0;
        for (const LevelCount& count : counts) {
          const double p =
              psychometric_probability(model.function, {threshold, slope, 0.5, lapse}, count.level);
          loss -= count.successes * std::log(p) + (count.trials - count.successes) * std::log1p(-p);
        }
        if (loss < least) least = loss;
      }
    }
  }
  return least;
}

TEST(PsychometricFit, IsNoLocalMaximum) {
  PsychometricModel model;
  model.guess.value = 0.5;
  model.lapse = {0, true, 0.06};
  const std::vector<std::pair<int, std::vector<int>>> studies{
      {10, {4, 9, 8, 9, 9}},      {10, {5, 7, 4, 9, 8}},   {20, {15, 13, 11, 19, 18}},
      {20, {15, 11, 14, 14, 20}}, {10, {4, 7, 10, 8, 10}}, {10, {9, 7, 10, 7, 10}}};
  for (const auto& [trials, successes] : studies) {
    std::vector<LevelCount> counts;
    for (std::size_t i = 0; i < successes.size(); ++i)
      counts.push_back({310 + 20.0 * static_cast<double>(i), trials, successes[i]});
    const PsychometricFit fit = fit_psychometric(counts, model);
    EXPECT_LE(-fit.log_likelihood, least_of_grid(counts, model) + 1e-6);
  }
}

TEST(PsychometricFit, IntervalsReachOverAValley) {
  PsychometricModel model;
  model.guess.value = 0.5;
  model.lapse = {0, true, 0.06};
  std::vector<LevelCount> counts;
  int i = 0;
  for (const int successes : {4, 7, 10, 8, 10}) counts.push_back({310 + 20.0 * i++, 10, successes});
  // At 350, twice the loss of profile likelihood is 3.18.
  EXPECT_GE(fit_psychometric(counts, model).threshold_ci95.high, 350);
}

TEST(PsychometricFit, SaysWhereThereIsNone) {
  EXPECT_EQ(fit_psychometric({}, {}).undefined, "no trials with a level");
  EXPECT_EQ(fit_psychometric({{1, 9, 4}}, {}).undefined, "fewer than two levels");
  EXPECT_EQ(fit_psychometric({{1, 9, 0}, {2, 9, 0}}, {}).undefined, "no success at any level");
  EXPECT_EQ(fit_psychometric({{1, 9, 9}, {2, 9, 9}}, {}).undefined, "no failure at any level");
}

TEST(PsychometricFit, StepHasSlopeAtBoundAndThresholdBetween) {
  const PsychometricFit fit = fit_psychometric({{1, 9, 0}, {2, 9, 0}, {3, 9, 9}, {4, 9, 9}}, {});
  EXPECT_GT(fit.parameters.threshold, 2);
  EXPECT_LT(fit.parameters.threshold, 3);
  EXPECT_TRUE(std::isinf(fit.slope_ci95.high));
  EXPECT_GT(fit.slope_ci95.low, 0);
  // Any between is as good: the middle, which a mirrored study has mirrored.
  PsychometricModel model;
  model.lapse = {0, true, 0.06};
  for (const double middle : {0.0, 500.0}) {
    const PsychometricFit step = fit_psychometric(
        {{middle - 20, 4, 0}, {middle - 10, 4, 0}, {middle + 10, 4, 4}, {middle + 20, 4, 4}},
        model);
    EXPECT_TRUE(step.slope_at_bound);
    EXPECT_NEAR(step.parameters.threshold, middle, 1e-9);
    EXPECT_NEAR(step.threshold_ci95.high - middle, middle - step.threshold_ci95.low, 1e-2);
  }
}

// What a step leaves of the deviance grows with the answers and differs from search to search.
TEST(PsychometricFit, SeparatedAnswersFitWellHoweverMany) {
  for (const auto shape : {PsychometricShape::logistic, PsychometricShape::normal}) {
    for (const bool both_ends : {false, true}) {
      PsychometricModel model;
      model.function.shape = shape;
      model.lapse = {0, true, kMostLapse};
      model.guess_is_lapse = both_ends;
      for (const int below : {1, 10, 30, 5000}) {
        for (const int above : {1, 3, 30, 3000}) {
          const std::vector<LevelCount> counts{
              {1, above, 0}, {2, below, 0}, {3, above, above}, {4, below, below}};
          const PsychometricFit fit = fit_psychometric(counts, model);
          EXPECT_NEAR(fit.parameters.threshold, 2.5, 1e-9) << below << ", " << above;
          const GoodnessOfFit good = goodness_of_fit(counts, model, fit, 199, 7);
          EXPECT_LT(good.deviance, 1e-4);
          EXPECT_EQ(good.p, 1) << below << ", " << above;
        }
      }
    }
  }
}

/// Log likelihood with the lapse rate at both ends, by the definition.
double log_likelihood_of(const std::vector<LevelCount>& counts, double threshold, double slope,
                         double lapse) {
  double sum = 0;
  for (const auto& [level, n, k] : counts) {
    const double p = lapse + (1 - 2 * lapse) / (1 + std::exp(-slope * (level - threshold)));
    sum += k * std::log(p) + (n - k) * std::log(1 - p);
  }
  return sum;
}

TEST(PsychometricFit, OneRateAtBothEndsBeatsAGrid) {
  const std::vector<LevelCount> counts{{-3, 80, 7}, {-2, 80, 8}, {-1, 80, 18}, {0, 80, 42},
                                       {1, 80, 66}, {2, 80, 72}, {3, 80, 74}};
  PsychometricModel model;
  model.lapse = {0, true, kMostLapse};
  model.guess_is_lapse = true;
  const PsychometricFit fit = fit_psychometric(counts, model);
  const auto& [threshold, slope, guess, lapse] = fit.parameters;
  EXPECT_EQ(guess, lapse);
  EXPECT_NEAR(lapse, kMostLapse, 1e-6) << "some 8 % at both ends";
  EXPECT_GT(fit.lapse_ci95.low, 0);
  EXPECT_EQ(fit.guess_ci95.low, fit.lapse_ci95.low);
  EXPECT_EQ(fit.guess_ci95.high, fit.lapse_ci95.high);
  EXPECT_NEAR(fit.log_likelihood, log_likelihood_of(counts, threshold, slope, lapse), 1e-9);
  // Maxima of the definition over a grid: of all parameters, and with one held.
  constexpr int kSteps = 240, kRateSteps = 60;
  double best = -1e300, at_low = best, at_high = best, rate_low = best;
  const double half_chi_squared = 0.5 * 3.841458820694124;
  for (int s = 0; s < kSteps; ++s) {
    const double x = std::exp(-1.5 + 3.0 * s / kSteps);
    for (int l = 0; l <= kRateSteps; ++l) {
      const double rate = kMostLapse * l / kRateSteps;
      at_low = std::max(at_low, log_likelihood_of(counts, fit.threshold_ci95.low, x, rate));
      at_high = std::max(at_high, log_likelihood_of(counts, fit.threshold_ci95.high, x, rate));
    }
    for (int t = 0; t < kSteps; ++t) {
      const double place = -0.6 + 1.2 * t / kSteps;
      best = std::max(best, log_likelihood_of(counts, place, x, kMostLapse));
      rate_low = std::max(rate_low, log_likelihood_of(counts, place, x, fit.lapse_ci95.low));
    }
  }
  EXPECT_LE(best, fit.log_likelihood + 1e-9);
  EXPECT_NEAR(best, fit.log_likelihood, 2e-3);
  EXPECT_NEAR(at_low, fit.log_likelihood - half_chi_squared, 2e-3);
  EXPECT_NEAR(at_high, fit.log_likelihood - half_chi_squared, 2e-3);
  EXPECT_NEAR(rate_low, fit.log_likelihood - half_chi_squared, 5e-3);
}

TEST(PsychometricFit, PositiveLevelsHaveNoThresholdBelowZero) {
  // Nearly always right: where guessing turns into certainty, nobody knows.
  PsychometricModel model;
  model.guess.value = 0.5;
  const std::vector<LevelCount> counts{
      {0.025, 20, 19}, {0.026, 20, 18}, {0.03, 20, 19}, {0.034, 20, 19}};
  for (const LevelScale scale : {LevelScale::linear, LevelScale::log10}) {
    model.function.scale = scale;
    const PsychometricFit fit = fit_psychometric(counts, model);
    EXPECT_GE(fit.parameters.threshold, 0);
    EXPECT_EQ(fit.threshold_ci95.low, 0);
    const PsychometricPosterior posterior = psychometric_posterior(counts, model);
    EXPECT_GE(posterior.threshold_ci95.low, 0);
  }
  // Levels from 1 to 100: half their range below the least would be -48.
  model.function.scale = LevelScale::linear;
  const PsychometricPosterior wide =
      psychometric_posterior({{1, 20, 15}, {50, 20, 15}, {100, 20, 16}}, model);
  EXPECT_GE(wide.threshold_ci95.low, 0);
  // Levels on both sides of 0, as angles: any threshold is possible.
  std::vector<LevelCount> angles = counts;
  for (LevelCount& count : angles) count.level = 1000 * count.level - 30;
  EXPECT_EQ(fit_psychometric(angles, model).threshold_ci95.low,
            -std::numeric_limits<double>::infinity());
}

TEST(PsychometricFit, ARateHasAnIntervalWithinItsLimits) {
  // By the definition: what is held, its profile likelihood over a grid of threshold and slope.
  PsychometricModel model;
  model.guess.value = 0.5;
  model.lapse = {0, true, 0.06};
  const std::vector<LevelCount> counts{{1, 60, 31}, {2, 60, 33}, {3, 60, 42},
                                       {4, 60, 54}, {5, 60, 59}, {8, 300, 297}};
  const auto loss_at = [&](double lapse) {
    double least = 1e300;
    for (double threshold = 2.5; threshold < 4; threshold += 0.005) {
      for (double slope = 0.8; slope < 6; slope *= 1.01) {
        double loss = 0;
        for (const auto& [level, n, k] : counts) {
          const double p = 0.5 + (0.5 - lapse) / (1 + std::exp(-slope * (level - threshold)));
          loss -= k * std::log(p) + (n - k) * std::log1p(-p);
        }
        least = std::min(least, loss);
      }
    }
    return least;
  };
  const PsychometricFit fit = fit_psychometric(counts, model);
  const double allowed = -fit.log_likelihood + 0.5 * 3.841458820694124;
  ASSERT_GT(fit.lapse_ci95.low, 0);
  ASSERT_LT(fit.lapse_ci95.high, 0.06);
  EXPECT_NEAR(loss_at(fit.lapse_ci95.low), allowed, 2e-3);
  EXPECT_NEAR(loss_at(fit.lapse_ci95.high), allowed, 2e-3);
  EXPECT_LT(fit.lapse_ci95.low, fit.parameters.lapse);
  EXPECT_LT(fit.parameters.lapse, fit.lapse_ci95.high);
  // Few trials tell nothing: all that is possible. A constant has no width.
  const PsychometricFit few = fit_psychometric({{1, 10, 5}, {2, 10, 7}, {3, 10, 9}}, model);
  EXPECT_EQ(few.lapse_ci95.low, 0);
  EXPECT_EQ(few.lapse_ci95.high, 0.06);
  EXPECT_EQ(few.guess_ci95.low, 0.5);
  EXPECT_EQ(few.guess_ci95.high, 0.5);
}

TEST(PsychometricFit, ThresholdsOutsideTheLevelsHaveOpenIntervals) {
  // Hardly anything above chance: how far the threshold is away, nobody knows.
  PsychometricModel model;
  model.guess.value = 0.5;
  const PsychometricFit fit =
      fit_psychometric({{1, 20, 10}, {2, 20, 11}, {3, 20, 10}, {4, 20, 12}}, model);
  EXPECT_TRUE(std::isinf(fit.threshold_ci95.high));
}

TEST(PsychometricFit, DiscriminationIsReadOffTheFunction) {
  PsychometricFit fit;
  fit.parameters = {510, 0.02, 0, 0};
  fit.threshold_ci95 = {500, 520};
  fit.slope_ci95 = {0.01, 0.04};
  const Discrimination logistic = discrimination(fit, {}, 500.0);
  EXPECT_NEAR(logistic.pse, 510, 1e-9);
  EXPECT_NEAR(*logistic.jnd, std::log(3) / 0.02, 1e-9);
  EXPECT_NEAR(logistic.jnd_ci95->high, std::log(3) / 0.01, 1e-9);
  EXPECT_NEAR(*logistic.weber_fraction, std::log(3) / 0.02 / 500, 1e-12);
  const Discrimination on_logs =
      discrimination(fit, {PsychometricShape::normal, LevelScale::log10}, std::nullopt);
  EXPECT_NEAR(*on_logs.weber_fraction, std::pow(10, 0.6744897501960817 / 0.02) - 1,
              1e-9 * *on_logs.weber_fraction);
  // The Weibull function's PSE is not its threshold: 1 - exp(-(x / t)^s) = 1/2.
  const Discrimination weibull =
      discrimination(fit, {PsychometricShape::weibull, LevelScale::log10}, std::nullopt);
  EXPECT_NEAR(weibull.pse, 510 * std::pow(std::log(2), 1 / 0.02), 1e-6);
}

TEST(PsychometricPosterior, EqualsADenseGrid) {
  const std::vector<LevelCount> counts{
      {1, 20, 11}, {2, 20, 12}, {3, 20, 15}, {4, 20, 17}, {5, 20, 20}};
  PsychometricModel model;
  model.guess.value = 0.5;
  const PsychometricPosterior posterior = psychometric_posterior(counts, model);
  // The same priors on a grid of 800 x 800 by the definition: thresholds 0 .. 7 (half the range
  // below would be -1), slopes by their log from 0.1 / 4 to 40 / 1.
  double sum = 0, mean_threshold = 0, square = 0, mean_log_slope = 0;
  for (int i = 0; i < 800; ++i) {
    const double t = 7 * (i + 0.5) / 800;
    for (int j = 0; j < 800; ++j) {
      const double s = std::log(0.025) + std::log(1600) * (j + 0.5) / 800;
      double weight = 1;
      for (const auto& [level, n, k] : counts) {
        const double p = 0.5 + 0.5 / (1 + std::exp(-std::exp(s) * (level - t)));
        weight *= std::pow(p, k) * std::pow(1 - p, n - k);
      }
      sum += weight;
      mean_threshold += weight * t;
      square += weight * t * t;
      mean_log_slope += weight * s;
    }
  }
  mean_threshold /= sum;
  EXPECT_NEAR(posterior.mean.threshold, mean_threshold, 2e-3);
  EXPECT_NEAR(posterior.threshold_scale_sd,
              std::sqrt(square / sum - mean_threshold * mean_threshold), 2e-3);
  EXPECT_NEAR(std::log(posterior.mean.slope), mean_log_slope / sum, 5e-3);
}

TEST(PsychometricPosterior, OneRateAtBothEndsEqualsDenseGrid) {
  const std::vector<LevelCount> counts{
      {1, 20, 2}, {2, 20, 3}, {3, 20, 9}, {4, 20, 17}, {5, 20, 18}};
  PsychometricModel model;
  model.lapse = {0, true, kMostLapse};
  model.guess_is_lapse = true;
  const PsychometricPosterior posterior = psychometric_posterior(counts, model);
  // The priors as above, and 10 (1 - rate)^9 once.
  double sum = 0, mean_threshold = 0, mean_log_slope = 0, mean_rate = 0;
  for (int l = 0; l < 40; ++l) {
    const double rate = kMostLapse * (l + 0.5) / 40;
    for (int i = 0; i < 200; ++i) {
      const double t = 7 * (i + 0.5) / 200;
      for (int j = 0; j < 200; ++j) {
        const double s = std::log(0.025) + std::log(1600) * (j + 0.5) / 200;
        const double weight =
            std::pow(1 - rate, 9) * std::exp(log_likelihood_of(counts, t, std::exp(s), rate));
        sum += weight;
        mean_threshold += weight * t;
        mean_log_slope += weight * s;
        mean_rate += weight * rate;
      }
    }
  }
  EXPECT_NEAR(posterior.mean.threshold, mean_threshold / sum, 3e-3);
  EXPECT_NEAR(std::log(posterior.mean.slope), mean_log_slope / sum, 8e-3);
  EXPECT_NEAR(posterior.mean.lapse, mean_rate / sum, 3e-4);
  EXPECT_EQ(posterior.mean.guess, posterior.mean.lapse);
  EXPECT_EQ(posterior.guess_ci95.low, posterior.lapse_ci95.low);
  EXPECT_EQ(posterior.guess_ci95.high, posterior.lapse_ci95.high);
}

}  // namespace
}  // namespace palpate::analysis
