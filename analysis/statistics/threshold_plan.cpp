#include "analysis/statistics/threshold_plan.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/sensitivity.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr int kPlanLevels = 7;
constexpr double kStandard = 1;  // levels are relative to it

/// The JND of a participant with a condition, as measured in a study.
std::optional<double> measured_jnd(const ThresholdStudy& study, double jnd, double assumed,
                                   double pse, std::size_t trials, Random& random) {
  PsychometricModel model;
  model.lapse = {0, true, kMostLapse};
  model.guess_is_lapse = true;
  const double slope = std::log(3.0) / jnd;  // F = 0.75 at a JND
  std::vector<LevelCount> counts;
  for (int i = 0; i < kPlanLevels; ++i) {
    const double place = 2.0 * i / (kPlanLevels - 1) - 1;
    LevelCount count{kStandard + place * study.reach * assumed, 0, 0};
    const double p =
        0.5 * study.lapse + (1 - study.lapse) / (1 + std::exp(-slope * (count.level - pse)));
    const auto index = static_cast<std::size_t>(i);
    count.trials = static_cast<int>(trials / kPlanLevels + (index < trials % kPlanLevels ? 1 : 0));
    for (int k = 0; k < count.trials; ++k) count.successes += random.unit() < p ? 1 : 0;
    if (count.trials > 0) counts.push_back(count);
  }
  const PsychometricFit fit = quick_fit(counts, model);
  if (!fit.undefined.empty() || fit.slope_at_bound) return std::nullopt;
  const double threshold = fit.parameters.threshold;
  if (threshold < counts.front().level || threshold > counts.back().level) return std::nullopt;
  return discrimination(fit, model.function, kStandard).jnd;
}

/// Log ratio of a participant's JNDs; nullopt: one is not determined.
std::optional<double> log_ratio_of(const ThresholdStudy& study, std::size_t trials, Random random) {
  const double first =
      study.weber_fraction * std::exp(study.participant_sd * random.normal()) * kStandard;
  const double ratio = study.ratio * std::exp(study.effect_sd * random.normal());
  const double assumed = study.weber_fraction * kStandard;
  const double pse = kStandard + study.pse_sd * assumed * random.normal();
  const auto one = measured_jnd(study, first, assumed, pse, trials, random);
  const auto two = measured_jnd(study, first * ratio, assumed, pse, trials, random);
  if (!one || !two || !(*one > 0) || !(*two > 0)) return std::nullopt;
  return std::log(*two / *one);
}

void add_study(const ThresholdStudy& study, const std::vector<std::optional<double>>& ratios,
               ThresholdPower& power, double& bias, double& covered, std::size_t& results) {
  std::vector<double> known;
  for (std::size_t i = 0; i < power.participants; ++i) {
    if (ratios[i]) known.push_back(*ratios[i]);
    power.undetermined += ratios[i] ? 0 : 1;
  }
  ++power.studies;
  const TTest test = t_test(known);
  if (!test.p || !test.log_ratio_ci95) return;
  const double truth = std::log(study.ratio);
  double mean = 0;
  for (const double one : known) mean += one / static_cast<double>(known.size());
  ++results;
  bias += mean - truth;
  covered += test.log_ratio_ci95->low <= truth && truth <= test.log_ratio_ci95->high ? 1 : 0;
  const bool right = study.ratio == 1 || (mean < 0) == (truth < 0);
  power.found += *test.p < study.alpha && right ? 1 : 0;
}

}  // namespace

ThresholdPlan plan_thresholds(const ThresholdStudy& study, ThresholdPlanSettings settings) {
  ThresholdPlan plan{study, std::move(settings), {}};
  const ThresholdPlanSettings& asked = plan.settings;
  const std::size_t most = asked.participants.back();
  for (std::size_t t = 0; t < asked.trials.size(); ++t) {
    std::vector<ThresholdPower> powers(asked.participants.size());
    std::vector<double> bias(powers.size(), 0), covered(powers.size(), 0);
    std::vector<std::size_t> results(powers.size(), 0);
    for (std::size_t s = 0; s < asked.studies; ++s) {
      std::vector<std::optional<double>> ratios;
      for (std::size_t i = 0; i < most; ++i)
        ratios.push_back(log_ratio_of(study, asked.trials[t],
                                      Random(asked.seed, {0x7a, asked.trials[t], s, i})));
      for (std::size_t n = 0; n < powers.size(); ++n) {
        powers[n].trials = asked.trials[t];
        powers[n].participants = asked.participants[n];
        add_study(study, ratios, powers[n], bias[n], covered[n], results[n]);
      }
      if (asked.progress)
        asked.progress((static_cast<double>(t) +
                        static_cast<double>(s + 1) / static_cast<double>(asked.studies)) /
                       static_cast<double>(asked.trials.size()));
    }
    for (std::size_t n = 0; n < powers.size(); ++n) {
      ThresholdPower& power = powers[n];
      power.power = static_cast<double>(power.found) / static_cast<double>(power.studies);
      power.ci95 = wilson_interval(power.found, power.studies);
      const auto count = static_cast<double>(std::max<std::size_t>(1, results[n]));
      power.bias = bias[n] / count;
      power.coverage = covered[n] / count;
      plan.powers.push_back(power);
    }
  }
  return plan;
}

}  // namespace palpate::analysis
