#include "analysis/statistics/psychometric_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/statistics/psychometric_likelihood.h"
#include "analysis/statistics/simplex.h"
#include "stimuli/random.h"

namespace palpate::analysis {
namespace {

using protocols::LevelScale;

constexpr double kHalfChiSquared95 = 0.5 * 3.841458820694124;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A free rate is most sin^2(x): never outside 0 .. most.
double rate_of(const RateModel& rate, double x) {
  const double s = std::sin(x);
  return rate.most * s * s;
}

/// How a minimum is looked for: a grid, from whose best places searches begin.
struct Search {
  int thresholds = 21, slopes = 19;
  std::size_t starts = 4;
};
constexpr Search kWholeSearch{}, kOneStart{21, 19, 1}, kQuickSearch{11, 9, 1};

/// Minus log likelihood over (threshold, log slope, free rates), any of the first two held.
class Objective {
 public:
  Objective(const PlacedData& data, const PsychometricModel& model) : data_(data), model_(model) {}

  struct Point {
    double threshold, log_slope, guess, lapse;
  };

  void hold_threshold(std::optional<double> value) { threshold_ = value; }
  void hold_log_slope(std::optional<double> value) { log_slope_ = value; }

  Point point(const std::vector<double>& x) const {
    std::size_t i = 0;
    Point p{};
    p.threshold = threshold_ ? *threshold_ : x[i++];
    p.log_slope = std::clamp(log_slope_ ? *log_slope_ : x[i++], data_.least_log_slope(),
                             data_.most_log_slope());
    p.guess = model_.guess.free ? rate_of(model_.guess, x[i++]) : model_.guess.value;
    p.lapse = model_.lapse.free ? rate_of(model_.lapse, x[i++]) : model_.lapse.value;
    return p;
  }

  double operator()(const std::vector<double>& x) const {
    const Point p = point(x);
    return -psychometric_log_likelihood(data_, model_.function, p.threshold, std::exp(p.log_slope),
                                        p.guess, p.lapse);
  }

  /// The best point from a start, whose places are those of point() that are not held.
  SimplexMinimum best_from(const std::vector<double>& start, double step, double tolerance) const {
    std::vector<double> steps;
    if (!threshold_) steps.push_back(step * (data_.high - data_.low));
    while (steps.size() < start.size()) steps.push_back(3 * step);
    return minimize([this](const std::vector<double>& x) { return (*this)(x); }, start, steps,
                    tolerance);
  }

  /// The best point from the best starts of a grid: the likelihood may have several maxima.
  SimplexMinimum best(const Search& search, double tolerance) const {
    SimplexMinimum found;
    found.value = kInfinity;
    for (const Start& start : starts_of_grid(search)) {
      SimplexMinimum one = best_from(start.place, 0.1, tolerance);
      if (one.value < found.value) found = std::move(one);
    }
    return found;
  }

  /// With one of threshold and slope held: the best place of a grid, if that is far from `place`.
  std::optional<std::vector<double>> other_start(const std::vector<double>& place) const {
    const std::vector<Start> starts = starts_of_grid(kOneStart);
    if (starts.empty()) return std::nullopt;
    const double cell =
        threshold_ ? (data_.most_log_slope() - data_.least_log_slope()) / (kOneStart.slopes - 1)
                   : (data_.high - data_.low) / (kOneStart.thresholds - 1);
    const bool far = std::abs(starts.front().place[0] - place[0]) > 2 * cell;
    return far ? std::optional(starts.front().place) : std::nullopt;
  }

 private:
  struct Start {
    double value = 0;
    int threshold = 0, slope = 0;  ///< cell of the grid
    std::vector<double> place;
  };

  /// Rates of the grid, as best_from takes them: near 0 and near their most.
  std::vector<std::vector<double>> rates_of_grid() const {
    std::vector<std::vector<double>> all{{}};
    for (const RateModel* rate : {&model_.guess, &model_.lapse}) {
      if (!rate->free) continue;
      std::vector<std::vector<double>> longer;
      for (const std::vector<double>& one : all) {
        for (const double x : {0.25, 1.3}) {
          longer.push_back(one);
          longer.back().push_back(x);
        }
      }
      all = std::move(longer);
    }
    return all;
  }

  /// The best ones, each two cells from those that are better.
  std::vector<Start> starts_of_grid(const Search& search) const {
    constexpr int kApart = 2;
    const double range = data_.high - data_.low;
    const double flat = data_.least_log_slope(), steep = data_.most_log_slope();
    std::vector<Start> all;
    const std::vector<std::vector<double>> rates = rates_of_grid();
    for (int t = 0; t < (threshold_ ? 1 : search.thresholds); ++t) {
      for (int s = 0; s < (log_slope_ ? 1 : search.slopes); ++s) {
        Start best;
        best.value = kInfinity;
        for (const std::vector<double>& rate : rates) {
          std::vector<double> place;
          if (!threshold_) place.push_back(data_.low + range * t / (search.thresholds - 1));
          if (!log_slope_) place.push_back(flat + (steep - flat) * s / (search.slopes - 1));
          place.insert(place.end(), rate.begin(), rate.end());
          const double value = (*this)(place);
          if (value < best.value) best = {value, t, s, std::move(place)};
        }
        if (best.value < kInfinity) all.push_back(std::move(best));
      }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Start& a, const Start& b) { return a.value < b.value; });
    std::vector<Start> chosen;
    for (Start& one : all) {
      const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const Start& other) {
        return std::abs(one.threshold - other.threshold) < kApart &&
               std::abs(one.slope - other.slope) < kApart;
      });
      if (!near) chosen.push_back(std::move(one));
      if (chosen.size() >= search.starts) break;
    }
    return chosen;
  }

  const PlacedData& data_;
  const PsychometricModel& model_;
  std::optional<double> threshold_, log_slope_;
};

/// Where a profile that is above 0 at `inside` falls to 0, towards `limit`; nullopt where it does
/// not.
template <class Profile>
std::optional<double> profile_end(const Profile& profile, double inside, double step,
                                  double limit) {
  const auto beyond = [&](double place) { return step > 0 ? place >= limit : place <= limit; };
  double at_inside = kHalfChiSquared95, outside = inside + step;
  double at_outside = beyond(outside) ? 1 : profile(outside);
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

/// Loss allowed less the smallest loss with a parameter held. Each search begins where the one
/// before ended, and at the best place of a grid: there may be another valley.
class Profile {
 public:
  using Hold = void (Objective::*)(std::optional<double>);

  Profile(const Objective& objective, Hold hold, std::vector<double> start, double allowed)
      : objective_(objective), hold_(hold), place_(std::move(start)), allowed_(allowed) {}

  double operator()(double held) {
    (objective_.*hold_)(held);
    SimplexMinimum best = objective_.best_from(place_, 0.02, 1e-8);
    if (const auto start = objective_.other_start(best.place)) {
      SimplexMinimum other = objective_.best_from(*start, 0.1, 1e-8);
      if (other.value < best.value) best = std::move(other);
    }
    place_ = std::move(best.place);
    return allowed_ - best.value;
  }

 private:
  Objective objective_;
  Hold hold_;
  std::vector<double> place_;
  double allowed_;
};

Interval threshold_interval(const PlacedData& data, const PsychometricModel& model,
                            const SimplexMinimum& best) {
  const Objective objective(data, model);
  const std::vector<double> others(best.place.begin() + 1, best.place.end());
  const double allowed = best.value + kHalfChiSquared95;
  const double range = data.high - data.low, step = 0.05 * range;
  Profile falling(objective, &Objective::hold_threshold, others, allowed), rising(falling);
  // Twenty ranges away from all levels: that is nowhere.
  const auto low = profile_end([&](double x) { return falling(x); }, best.place[0], -step,
                               data.low - 20 * range);
  const auto high =
      profile_end([&](double x) { return rising(x); }, best.place[0], step, data.high + 20 * range);
  const LevelScale scale = model.function.scale;
  const double nowhere = scale == LevelScale::linear ? -kInfinity : 0;
  return {low ? protocols::level_at(scale, *low) : nowhere,
          high ? protocols::level_at(scale, *high) : kInfinity};
}

Interval slope_interval(const PlacedData& data, const PsychometricModel& model,
                        const SimplexMinimum& best, double log_slope) {
  const Objective objective(data, model);
  std::vector<double> others = best.place;
  others.erase(others.begin() + 1);
  const double allowed = best.value + kHalfChiSquared95;
  Profile falling(objective, &Objective::hold_log_slope, others, allowed), rising(falling);
  const auto low =
      profile_end([&](double x) { return falling(x); }, log_slope, -0.2, data.least_log_slope());
  const auto high =
      profile_end([&](double x) { return rising(x); }, log_slope, 0.2, data.most_log_slope());
  return {low ? std::exp(*low) : 0, high ? std::exp(*high) : kInfinity};
}

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

/// Point estimates alone, as the simulations need them.
PsychometricFit fit_point(const std::vector<LevelCount>& counts, const PlacedData& data,
                          const PsychometricModel& model, const Search& search,
                          SimplexMinimum& best) {
  PsychometricFit fit;
  fit.undefined = reason_not_to_fit(counts, data);
  for (const LevelCount& count : counts) fit.trials += count.trials;
  if (!fit.undefined.empty()) return fit;
  const Objective objective(data, model);
  best = objective.best(search, 1e-11);
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
    if (deviance >= result.deviance * (1 - 1e-9)) ++as_large;
  }
  result.simulations = simulations;
  result.p = static_cast<double>(as_large) / (simulations + 1);
  return result;
}

Discrimination discrimination(const PsychometricFit& fit,
                              const protocols::PsychometricFunction& function,
                              std::optional<double> standard) {
  const auto level = [&](double threshold, double slope, double share) {
    return psychometric_level(function, {threshold, slope}, share);
  };
  const auto& [threshold, slope, guess, lapse] = fit.parameters;
  Discrimination result;
  result.pse = level(threshold, slope, 0.5);
  // The distance of PSE and threshold is 0 but for the Weibull function, where its slope is held.
  result.pse_ci95 = {level(fit.threshold_ci95.low, slope, 0.5),
                     level(fit.threshold_ci95.high, slope, 0.5)};
  const auto half = [&](double at_slope) {
    // Of the scale: the same at any threshold.
    const auto place = [&](double share) {
      return protocols::scale_position(function.scale, level(1, at_slope, share));
    };
    return 0.5 * std::abs(place(0.75) - place(0.25));
  };
  const auto& [flat, steep] = fit.slope_ci95;
  const double widest = flat > 0 ? half(flat) : kInfinity;
  const double narrowest = std::isfinite(steep) ? half(steep) : 0;
  if (function.scale == LevelScale::linear) {
    result.jnd = half(slope);
    result.jnd_ci95 = {narrowest, widest};
    const double base = standard.value_or(result.pse);
    if (!(base > 0)) return result;
    result.weber_fraction = *result.jnd / base;
    result.weber_fraction_ci95 = {narrowest / base, widest / base};
    return result;
  }
  const auto ratio = [&](double distance) {
    return std::isfinite(distance) ? protocols::level_at(function.scale, distance) - 1 : kInfinity;
  };
  result.weber_fraction = ratio(half(slope));
  result.weber_fraction_ci95 = {ratio(narrowest), ratio(widest)};
  const double base = standard.value_or(result.pse);
  result.jnd = *result.weber_fraction * base;
  result.jnd_ci95 = {result.weber_fraction_ci95->low * base,
                     result.weber_fraction_ci95->high * base};
  return result;
}

}  // namespace palpate::analysis
