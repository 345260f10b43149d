#include "analysis/statistics/psychometric_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "analysis/statistics/psychometric_likelihood.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Function = std::function<double(const std::vector<double>&)>;

constexpr int kMostMoves = 2000;
constexpr int kMostRestarts = 20;

/// centre + t (centre - from)
std::vector<double> along(const std::vector<double>& centre, const std::vector<double>& from,
                          double t) {
  std::vector<double> place(centre.size());
  for (std::size_t i = 0; i < place.size(); ++i) place[i] = centre[i] + t * (centre[i] - from[i]);
  return place;
}

std::vector<double> centre_of_all_but_last(const std::vector<SimplexMinimum>& corners) {
  std::vector<double> centre(corners.size() - 1, 0);
  for (std::size_t c = 0; c + 1 < corners.size(); ++c) {
    for (std::size_t i = 0; i < centre.size(); ++i)
      centre[i] += corners[c].place[i] / static_cast<double>(centre.size());
  }
  return centre;
}

void sort_corners(std::vector<SimplexMinimum>& corners) {
  std::sort(corners.begin(), corners.end(),
            [](const auto& a, const auto& b) { return a.value < b.value; });
}

SimplexMinimum descend(const Function& function, const std::vector<double>& start,
                       const std::vector<double>& steps, double tolerance) {
  std::vector<SimplexMinimum> corners{{start, function(start)}};
  for (std::size_t i = 0; i < start.size(); ++i) {
    std::vector<double> place = start;
    place[i] += steps[i];
    corners.push_back({place, function(place)});
  }
  const auto at = [&](std::vector<double> place) {
    const double value = function(place);
    return SimplexMinimum{std::move(place), value};
  };
  for (int move = 0; move < kMostMoves; ++move) {
    sort_corners(corners);
    SimplexMinimum& worst = corners.back();
    if (worst.value - corners.front().value <= tolerance) break;
    const std::vector<double> centre = centre_of_all_but_last(corners);
    SimplexMinimum reflected = at(along(centre, worst.place, 1));
    if (reflected.value < corners.front().value) {
      SimplexMinimum expanded = at(along(centre, worst.place, 2));
      worst = expanded.value < reflected.value ? std::move(expanded) : std::move(reflected);
    } else if (reflected.value < corners[corners.size() - 2].value) {
      worst = std::move(reflected);
    } else {
      const bool outside = reflected.value < worst.value;
      SimplexMinimum contracted = at(along(centre, worst.place, outside ? 0.5 : -0.5));
      if (contracted.value < std::min(reflected.value, worst.value)) {
        worst = std::move(contracted);
      } else {
        for (std::size_t c = 1; c < corners.size(); ++c)
          corners[c] = at(along(corners.front().place, corners[c].place, -0.5));
      }
    }
  }
  sort_corners(corners);
  return corners.front();
}

using protocols::LevelScale;

constexpr double kOpenEnd = std::numeric_limits<double>::infinity();

/// Allowed loss minus the smallest loss with a parameter held. Each search starts at the end of the
/// previous one and at the best point of a grid, as there may be another minimum.
template <class Hold>
class Profile {
 public:
  /// \param hold  holds a parameter of an objective at a value
  Profile(const PsychometricObjective& objective, Hold hold, std::vector<double> start,
          double allowed)
      : objective_(objective), hold_(hold), place_(std::move(start)), allowed_(allowed) {}

  double operator()(double held) {
    hold_(objective_, held);
    SimplexMinimum best = objective_.best_from(place_, 0.02, 1e-8);
    if (const auto start = objective_.other_start(best.place)) {
      SimplexMinimum other = objective_.best_from(*start, 0.1, 1e-8);
      if (other.value < best.value) best = std::move(other);
    }
    place_ = std::move(best.place);
    return allowed_ - best.value;
  }

 private:
  PsychometricObjective objective_;
  Hold hold_;
  std::vector<double> place_;
  double allowed_;
};

/// The point towards `limit` where a profile, above 0 at `inside`, falls to 0; nullopt: it does
/// not, or `inside` is at the limit.
template <class Profile>
std::optional<double> profile_end(const Profile& profile, double inside, double step,
                                  double limit) {
  const auto beyond = [&](double place) { return step > 0 ? place >= limit : place <= limit; };
  if (beyond(inside)) return std::nullopt;
  double at_inside = kHalfChiSquared95, outside = beyond(inside + step) ? limit : inside + step;
  double at_outside = profile(outside);
  while (at_outside > 0) {
    if (outside == limit) return std::nullopt;
    inside = outside;
    at_inside = at_outside;
    step *= 1.7;
    outside = beyond(outside + step) ? limit : outside + step;
    at_outside = profile(outside);
  }
  // Regula falsi, halving the value of the end that stays (Illinois).
  const double width = std::abs(outside - inside);
  for (int i = 0; i < 40 && std::abs(outside - inside) > 1e-7 * width; ++i) {
    const double place = inside + (outside - inside) * at_inside / (at_inside - at_outside);
    const double value = profile(place);
    if (std::abs(value) < 1e-6) return place;
    if (value > 0) {
      inside = place;
      at_inside = value;
      at_outside *= 0.5;
    } else {
      outside = place;
      at_outside = value;
      at_inside *= 0.5;
    }
  }
  return 0.5 * (inside + outside);
}

// 95 % intervals by profile likelihood: within them, twice the loss of log likelihood stays below
// the 0.95 quantile of chi squared with one degree of freedom.
Interval threshold_interval(const PlacedData& data, const PsychometricModel& model,
                            const SimplexMinimum& best) {
  const PsychometricObjective objective(data, model);
  const std::vector<double> others(best.place.begin() + 1, best.place.end());
  const double allowed = best.value + kHalfChiSquared95;
  const double range = data.high - data.low, step = 0.05 * range;
  Profile falling(
      objective, [](auto&held, double x) { held.hold_threshold(x); }, others, allowed),
      rising(falling);
  // Twenty ranges away from all levels counts as infinite.
  const double at = objective.point(best.place).threshold;
  const auto low = profile_end([&](double x) { return falling(x); }, at, -step,
                               std::max(data.low - 20 * range, data.least));
  const auto high =
      profile_end([&](double x) { return rising(x); }, at, step, data.high + 20 * range);
  const LevelScale scale = model.function.scale;
  const double nowhere = scale == LevelScale::linear ? data.least : 0;
  return {low ? protocols::level_at(scale, *low) : nowhere,
          high ? protocols::level_at(scale, *high) : kOpenEnd};
}

/// Interval of the slope. \param log_slope of the fit
Interval slope_interval(const PlacedData& data, const PsychometricModel& model,
                        const SimplexMinimum& best, double log_slope) {
  const PsychometricObjective objective(data, model);
  std::vector<double> others = best.place;
  others.erase(others.begin() + 1);
  const double allowed = best.value + kHalfChiSquared95;
  Profile falling(
      objective, [](auto&held, double x) { held.hold_log_slope(x); }, others, allowed),
      rising(falling);
  const auto low =
      profile_end([&](double x) { return falling(x); }, log_slope, -0.2, data.least_log_slope());
  const auto high =
      profile_end([&](double x) { return rising(x); }, log_slope, 0.2, data.most_log_slope());
  return {low ? std::exp(*low) : 0, high ? std::exp(*high) : kOpenEnd};
}

/// Interval of the guess or lapse rate, within 0 and its maximum; for a constant, the constant
/// twice. One rate for both asymptotes is the lapse rate.
Interval rate_interval(const PlacedData& data, const PsychometricModel& model,
                       const SimplexMinimum& best, PsychometricRate rate) {
  const PsychometricObjective objective(data, model);
  const RateModel& of = rate == PsychometricRate::guess ? model.guess : model.lapse;
  if (!of.free) return {of.value, of.value};
  const auto point = objective.point(best.place);
  const double at = rate == PsychometricRate::guess ? point.guess : point.lapse;
  std::vector<double> others = best.place;
  const bool after_guess = rate == PsychometricRate::lapse && model.guess_is_free();
  others.erase(others.begin() + (after_guess ? 3 : 2));
  const double allowed = best.value + kHalfChiSquared95, step = 0.1 * of.most;
  Profile falling(
      objective, [rate](auto&held, double x) { held.hold_rate(rate, x); }, others, allowed),
      rising(falling);
  const auto low = profile_end([&](double x) { return falling(x); }, at, -step, 0);
  const auto high = profile_end([&](double x) { return rising(x); }, at, step, of.most);
  return {low.value_or(0), high.value_or(of.most)};
}

std::string reason_not_to_fit(const std::vector<LevelCount>& counts, const PlacedData& data) {
  int trials = 0, successes = 0;
  for (const LevelCount& count : counts) {
    trials += count.trials;
    successes += count.successes;
  }
  if (trials == 0) return "no trials with a level";
  if (!(data.high > data.low)) return "fewer than two levels";
  if (successes == 0) return "no success at any level";
  if (successes == trials) return "no failure at any level";
  return "";
}

/// Smaller differences of log likelihood count as 0. The steepest slope leaves some 2e-9 of every
/// answer beside a step, depending on the end of a search: two fits of perfectly separated answers
/// differ by 1e-7 to 1e-5.
constexpr double kSameLogLikelihood = 1e-4;

/// With perfect separation between two neighbouring levels, every threshold between them fits
/// equally: takes the middle, with the steepest slope.
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

/// Point estimates only, for the simulations.
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

constexpr std::size_t kCoarse = 25, kFine = 81, kRates = 10;

/// Values of a parameter, each in the middle of an equal part of a range, and their marginal
/// posterior.
struct PosteriorAxis {
  double low = 0, high = 0;
  std::vector<double> values, marginal;

  PosteriorAxis(double from, double to, std::size_t count) : low(from), high(to) {
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(from +
                       (to - from) * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
    marginal.assign(count, 0);
  }

  double width() const { return (high - low) / static_cast<double>(values.size()); }

  double mean() const {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[i] * marginal[i];
    return sum;
  }

  double sd() const {
    const double middle = mean();
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += marginal[i] * (values[i] - middle) * (values[i] - middle);
    return std::sqrt(sum);
  }

  /// The density is uniform within a part of the range.
  double quantile(double share) const {
    double below = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (below + marginal[i] >= share && marginal[i] > 0)
        return values[i] + width() * ((share - below) / marginal[i] - 0.5);
      below += marginal[i];
    }
    return high;
  }

  /// The part that excludes a millionth on either side, with a margin.
  std::array<double, 2> core() const {
    return {std::max(low, quantile(1e-6) - width()), std::min(high, quantile(1 - 1e-6) + width())};
  }
};

PosteriorAxis rate_axis(const RateModel& rate) {
  return rate.free ? PosteriorAxis(0, rate.most, kRates) : PosteriorAxis(rate.value, rate.value, 1);
}

double log_prior(const RateModel& rate, double value) {
  return rate.free ? 9 * std::log1p(-value) : 0;
}

/// One rate for both asymptotes uses the axis of lapses only; that of guesses has one unused value.
PosteriorAxis guess_axis(const PsychometricModel& model) {
  return rate_axis(model.guess_is_lapse ? RateModel{} : model.guess);
}

struct PosteriorGrid {
  PosteriorAxis threshold, log_slope, guess, lapse;
};

void add_marginals(PosteriorGrid& grid, const PlacedData& data, const PsychometricModel& model) {
  std::vector<double> logs;
  double largest = -1e300;
  for (const double t : grid.threshold.values) {
    for (const double s : grid.log_slope.values) {
      for (const double g : grid.guess.values) {
        for (const double l : grid.lapse.values) {
          const double low = model.guess_is_lapse ? l : g;
          double log_posterior =
              psychometric_log_likelihood(data, model.function, t, std::exp(s), low, l) +
              log_prior(model.lapse, l);
          if (!model.guess_is_lapse) log_posterior += log_prior(model.guess, g);
          logs.push_back(log_posterior);
          largest = std::max(largest, logs.back());
        }
      }
    }
  }
  double sum = 0;
  for (double& value : logs) sum += value = std::exp(value - largest);
  std::size_t i = 0;
  for (double& t : grid.threshold.marginal) {
    for (double& s : grid.log_slope.marginal) {
      for (double& g : grid.guess.marginal) {
        for (double& l : grid.lapse.marginal) {
          const double share = logs[i++] / sum;
          t += share;
          s += share;
          g += share;
          l += share;
        }
      }
    }
  }
}

Interval central(const PosteriorAxis& axis) { return {axis.quantile(0.025), axis.quantile(0.975)}; }

}  // namespace

SimplexMinimum minimize(const Function& function, const std::vector<double>& start,
                        const std::vector<double>& steps, double tolerance) {
  if (start.empty()) return {{}, function({})};
  SimplexMinimum best = descend(function, start, steps, tolerance);
  for (int i = 0; i < kMostRestarts; ++i) {
    std::vector<double> smaller = steps;
    for (double& step : smaller) step *= i % 2 == 0 ? -0.1 : 0.1;
    SimplexMinimum again = descend(function, best.place, smaller, tolerance);
    const double gain = best.value - again.value;
    if (gain > 0) best = std::move(again);
    if (!(gain > 100 * tolerance)) break;
  }
  return best;
}

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
  Random random(seed, {0xd0});
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
    // All answers equal: a function with that asymptote fits without deviance.
    const double deviance = refit.undefined.empty() ? deviance_of(simulated, refit) : 0;
    if (deviance >= result.deviance - 2 * kSameLogLikelihood) ++as_large;
  }
  result.simulations = simulations;
  result.p = static_cast<double>(as_large) / (simulations + 1);
  return result;
}

PsychometricPosterior psychometric_posterior(const std::vector<LevelCount>& counts,
                                             const PsychometricModel& model) {
  PsychometricPosterior result;
  const PlacedData data = place_counts(counts, model.function);
  if (!(data.high > data.low)) {
    result.undefined = "fewer than two levels";
    return result;
  }
  const double half = 0.5 * (data.high - data.low);
  PosteriorGrid coarse{
      PosteriorAxis(std::max(data.low - half, data.least), data.high + half, kCoarse),
      PosteriorAxis(data.least_log_slope(), data.most_log_slope(), kCoarse), guess_axis(model),
      rate_axis(model.lapse)};
  add_marginals(coarse, data, model);
  const auto [t_low, t_high] = coarse.threshold.core();
  const auto [s_low, s_high] = coarse.log_slope.core();
  PosteriorGrid fine{PosteriorAxis(t_low, t_high, kFine), PosteriorAxis(s_low, s_high, kFine),
                     guess_axis(model), rate_axis(model.lapse)};
  add_marginals(fine, data, model);

  const auto level = [&](double place) { return protocols::level_at(model.function.scale, place); };
  const double lapse = fine.lapse.mean();
  result.mean = {level(fine.threshold.mean()), std::exp(fine.log_slope.mean()),
                 model.guess_is_lapse ? lapse : fine.guess.mean(), lapse};
  result.threshold_scale_sd = fine.threshold.sd();
  const Interval threshold = central(fine.threshold), slope = central(fine.log_slope);
  result.threshold_ci95 = {level(threshold.low), level(threshold.high)};
  result.slope_ci95 = {std::exp(slope.low), std::exp(slope.high)};
  result.lapse_ci95 = central(fine.lapse);
  result.guess_ci95 = model.guess_is_lapse ? result.lapse_ci95 : central(fine.guess);
  return result;
}

}  // namespace palpate::analysis
