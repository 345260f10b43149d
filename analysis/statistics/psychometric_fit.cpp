#include "analysis/statistics/psychometric_fit.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "analysis/statistics/psychometric_intervals.h"
#include "analysis/statistics/psychometric_objective.h"
#include "stimuli/random.h"

namespace palpate::analysis {
namespace {

std::string reason_not_to_fit(const std::vector<LevelCount>& counts, const PlacedData& data) {
  int trials = 0, successes = 0;
  for (const LevelCount& count : counts) {
    trials += count.trials;
    successes += count.successes;
  }
  if (trials == 0) return "no trials";
  if (!(data.high > data.low)) return "fewer than two levels";
  if (successes == 0) return "no success at any level";
  if (successes == trials) return "no failure at any level";
  return "";
}

/// Differences of log likelihood below are none. The steepest slope leaves some 2e-9 of every
/// answer beside a step, which depends on where a search ends: two fits of perfectly separated
/// answers differ by 1e-7 to 1e-5.
constexpr double kSameLogLikelihood = 1e-4;

/// Where answers change between two levels at once, every threshold between them is as good: then
/// it is the middle, with the steepest slope.
void take_middle_of_step(const PsychometricObjective& objective, const PlacedData& data,
                         SimplexMinimum& best) {
  const auto above = std::find_if(data.places.begin(), data.places.end(),
                                  [&](double place) { return place > best.place[0]; });
  if (above == data.places.begin() || above == data.places.end()) return;
  std::vector<double> step = best.place;
  step[0] = 0.5 * (*std::prev(above) + *above);
  step[1] = data.most_log_slope();
  const double value = objective(step);
  if (value <= best.value + kSameLogLikelihood) best = {std::move(step), value};
}

/// Point estimates alone, as the simulations need them.
PsychometricFit fit_point(const std::vector<LevelCount>& counts, const PlacedData& data,
                          const PsychometricModel& model, const PsychometricSearch& search,
                          SimplexMinimum& best) {
  PsychometricFit fit;
  fit.undefined = reason_not_to_fit(counts, data);
  for (const LevelCount& count : counts) fit.trials += count.trials;
  if (!fit.undefined.empty()) return fit;
  const PsychometricObjective objective(data, model);
  best = objective.best(search, 1e-11);
  take_middle_of_step(objective, data, best);
  const auto point = objective.point(best.place);
  fit.log_likelihood = -best.value;
  fit.parameters = {protocols::level_at(model.function.scale, point.threshold),
                    std::exp(point.log_slope), point.guess, point.lapse};
  fit.slope_at_bound = point.log_slope >= data.most_log_slope() - 1e-6;
  return fit;
}

double deviance_of(const std::vector<LevelCount>& counts, const PsychometricFit& fit) {
  double saturated = 0;
  for (const LevelCount& count : counts) {
    const double n = count.trials, k = count.successes;
    if (k > 0) saturated += k * std::log(k / n);
    if (k < n) saturated += (n - k) * std::log(1 - k / n);
  }
  return std::max(0.0, 2 * (saturated - fit.log_likelihood));
}

}  // namespace

std::vector<LevelCount> sum_by_level(std::vector<LevelCount> counts) {
  std::sort(counts.begin(), counts.end(),
            [](const auto& a, const auto& b) { return a.level < b.level; });
  std::vector<LevelCount> sums;
  for (const LevelCount& count : counts) {
    if (sums.empty() || sums.back().level != count.level) {
      sums.push_back(count);
    } else {
      sums.back().trials += count.trials;
      sums.back().successes += count.successes;
    }
  }
  return sums;
}

PsychometricFit fit_psychometric(const std::vector<LevelCount>& counts,
                                 const PsychometricModel& model) {
  const PlacedData data = place_counts(counts, model.function);
  SimplexMinimum best;
  PsychometricFit fit = fit_point(counts, data, model, kWholeSearch, best);
  if (!fit.undefined.empty()) return fit;
  fit.threshold_ci95 = threshold_interval(data, model, best);
  fit.slope_ci95 = slope_interval(data, model, best, std::log(fit.parameters.slope));
  fit.lapse_ci95 = rate_interval(data, model, best, PsychometricRate::lapse);
  fit.guess_ci95 = model.guess_is_lapse ? fit.lapse_ci95
                                        : rate_interval(data, model, best, PsychometricRate::guess);
  return fit;
}

PsychometricFit quick_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model) {
  SimplexMinimum best;
  return fit_point(counts, place_counts(counts, model.function), model, kQuickSearch, best);
}

GoodnessOfFit goodness_of_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model,
                              const PsychometricFit& fit, int simulations, std::uint64_t seed) {
  GoodnessOfFit result;
  const std::vector<LevelCount> sums = sum_by_level(counts);
  result.levels = static_cast<int>(sums.size());
  if (!fit.undefined.empty()) return result;
  result.deviance = deviance_of(sums, fit);
  if (simulations == 0) return result;
  stimuli::Random random(seed, {0xd0});
  int as_large = 1;
  for (int i = 0; i < simulations; ++i) {
    std::vector<LevelCount> simulated = sums;
    for (LevelCount& count : simulated) {
      const double p = psychometric_probability(model.function, fit.parameters, count.level);
      count.successes = 0;
      for (int n = 0; n < count.trials; ++n) count.successes += random.unit() < p ? 1 : 0;
    }
    const PlacedData data = place_counts(simulated, model.function);
    SimplexMinimum best;
    const PsychometricFit refit = fit_point(simulated, data, model, kQuickSearch, best);
    // All answers alike: any function that goes there fits without deviance.
    const double deviance = refit.undefined.empty() ? deviance_of(simulated, refit) : 0;
    if (deviance >= result.deviance - 2 * kSameLogLikelihood) ++as_large;
  }
  result.simulations = simulations;
  result.p = static_cast<double>(as_large) / (simulations + 1);
  return result;
}

}  // namespace palpate::analysis
