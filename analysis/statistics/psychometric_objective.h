#pragma once
// What a fit of a psychometric function makes as small as it can be, and how it looks for that.

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/statistics/psychometric_likelihood.h"
#include "analysis/statistics/simplex.h"

namespace palpate::analysis {

/// How a minimum is looked for: a grid, from whose best places searches begin.
struct PsychometricSearch {
  int thresholds = 21, slopes = 19;
  std::size_t starts = 4;
};
/// Of a fit, and of the refits of simulations.
inline constexpr PsychometricSearch kWholeSearch{}, kQuickSearch{11, 9, 1};

enum class PsychometricRate { guess, lapse };

/// Minus log likelihood over (threshold on the scale, log slope, free rates), one of them held or
/// none. A free rate is most sin^2(x): never outside 0 .. most.
class PsychometricObjective {
 public:
  /// Both must outlive it. One rate at both ends is the lapse rate: hold that.
  PsychometricObjective(const PlacedData& data, const PsychometricModel& model)
      : data_(data), model_(model) {}

  struct Point {
    double threshold, log_slope, guess, lapse;
  };

  void hold_threshold(std::optional<double> value) { threshold_ = value; }
  void hold_log_slope(std::optional<double> value) { log_slope_ = value; }
  void hold_rate(PsychometricRate rate, std::optional<double> value) {
    (rate == PsychometricRate::guess ? guess_ : lapse_) = value;
  }

  Point point(const std::vector<double>& x) const;
  double operator()(const std::vector<double>& x) const;

  /// The best point from a start, whose places are those of point() that are not held.
  SimplexMinimum best_from(const std::vector<double>& start, double step, double tolerance) const;
  /// The best point from the best starts of a grid: the likelihood may have several maxima.
  SimplexMinimum best(const PsychometricSearch& search, double tolerance) const;
  /// With a parameter held: the best place of a grid, if that is far from `place`.
  std::optional<std::vector<double>> other_start(const std::vector<double>& place) const;

 private:
  struct Start {
    double value = 0;
    int threshold = 0, slope = 0;  ///< cell of the grid
    std::vector<double> place;
  };

  std::vector<std::vector<double>> rates_of_grid() const;
  std::vector<Start> starts_of_grid(const PsychometricSearch& search) const;

  const PlacedData& data_;
  const PsychometricModel& model_;
  std::optional<double> threshold_, log_slope_, guess_, lapse_;  ///< held
};

}  // namespace palpate::analysis
