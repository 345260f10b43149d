#include "analysis/statistics/reaching.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::analysis {
namespace {

constexpr double kLeastExplained = 0.1;  // share of the variance
constexpr double kRounding = 1e-18;      // of a mean square; a lesser variance is none
constexpr double kFastest = 0.25;        // trials
constexpr int kGrid = 60;                // of the logarithm of the time constant, before the search

struct Line {
  double at_zero = 0, slope = 0, squares = 0;
};

/// Of the values over exp(-trial / trials).
Line line_at(const std::vector<ReachPoint>& points, double trials) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const ReachPoint& one : points) {
    const double e = std::exp(-one.trial / trials);
    n += 1;
    x += e;
    y += one.value;
    xx += e * e;
    xy += e * one.value;
  }
  Line line;
  const double spread = xx - x * x / n;
  line.slope = spread > 1e-12 ? (xy - x * y / n) / spread : 0;
  line.at_zero = (y - line.slope * x) / n;
  for (const ReachPoint& one : points) {
    const double rest = one.value - line.at_zero - line.slope * std::exp(-one.trial / trials);
    line.squares += rest * rest;
  }
  return line;
}

/// The logarithm within which the sum of squares is least, by golden section.
double least_between(const std::vector<ReachPoint>& points, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  const auto at = [&](double log_trials) { return line_at(points, std::exp(log_trials)).squares; };
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = at(a), at_b = at(b);
  for (int i = 0; i < 60; ++i) {
    if (at_a < at_b) {
      high = std::exchange(b, a);
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = at(a);
    } else {
      low = std::exchange(a, b);
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = at(b);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

LearningFit fit_learning(const std::vector<ReachPoint>& points) {
  LearningFit fit;
  if (points.size() < kLeastPoints) {
    fit.undefined = "fewer than " + std::to_string(kLeastPoints) + " trials";
    return fit;
  }
  double mean = 0, variance = 0, last = 0, all = 0;
  for (const ReachPoint& one : points) {
    mean += one.value / static_cast<double>(points.size());
    last = std::max(last, one.trial);
    all += one.value * one.value;
  }
  for (const ReachPoint& one : points) variance += (one.value - mean) * (one.value - mean);
  const double low = std::log(kFastest), high = std::log(std::max(2 * kFastest, 3 * last));
  const double step = (high - low) / kGrid;
  int best = 0;
  for (int i = 1; i <= kGrid; ++i) {
    const auto squares = [&](int at) { return line_at(points, std::exp(low + at * step)).squares; };
    if (squares(i) < squares(best)) best = i;
  }
  const double log_trials = least_between(points, low + std::max(0, best - 1) * step,
                                          low + std::min(kGrid, best + 1) * step);
  fit.trials = std::exp(log_trials);
  const Line line = line_at(points, fit.trials);
  fit.start = line.at_zero + line.slope;
  fit.end = line.at_zero;
  fit.residual_sd = std::sqrt(line.squares / static_cast<double>(points.size() - 3));
  if (!(variance > kRounding * all) || 1 - line.squares / variance < kLeastExplained) {
    fit.undefined = "no course over the trials";
  } else if (best == 0 || best == kGrid) {
    fit.undefined = best == 0 ? "learnt faster than single trials show"
                              : "learnt more slowly than the trials show";
  }
  return fit;
}

}  // namespace palpate::analysis
