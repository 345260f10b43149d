#include "analysis/statistics/discrimination.h"

#include <cmath>
#include <limits>

namespace palpate::analysis {
namespace {

using protocols::LevelScale;

constexpr double kNoBound = std::numeric_limits<double>::infinity();

}  // namespace

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
  const double widest = flat > 0 ? half(flat) : kNoBound;
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
    return std::isfinite(distance) ? protocols::level_at(function.scale, distance) - 1 : kNoBound;
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
