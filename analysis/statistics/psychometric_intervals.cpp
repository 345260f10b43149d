#include "analysis/statistics/psychometric_intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace palpate::analysis {
namespace {

using protocols::LevelScale;

constexpr double kHalfChiSquared95 = 0.5 * 3.841458820694124;
constexpr double kOpenEnd = std::numeric_limits<double>::infinity();

/// Where a profile that is above 0 at `inside` falls to 0, towards `limit`; nullopt where it does
/// not, or `inside` is there already.
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

/// Loss allowed less the smallest loss with a parameter held. Each search begins where the one
/// before ended, and at the best place of a grid: there may be another valley.
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

}  // namespace

Interval threshold_interval(const PlacedData& data, const PsychometricModel& model,
                            const SimplexMinimum& best) {
  const PsychometricObjective objective(data, model);
  const std::vector<double> others(best.place.begin() + 1, best.place.end());
  const double allowed = best.value + kHalfChiSquared95;
  const double range = data.high - data.low, step = 0.05 * range;
  Profile falling(
      objective, [](auto&held, double x) { held.hold_threshold(x); }, others, allowed),
      rising(falling);
  // Twenty ranges away from all levels: that is nowhere.
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

}  // namespace palpate::analysis
