#pragma once
// The likelihood common to fits of psychometric functions: counts placed on the scale, the
// objective of a fit, and its search.

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {

/// Counts with the positions of their levels on the scale.
struct PlacedCount {
  double place = 0;
  double trials = 0, successes = 0;
};

struct PlacedData {
  std::vector<PlacedCount> counts;
  std::vector<double> places;  ///< finite ones, distinct, ascending
  double low = 0, high = 0;    ///< the first and the last
  double spacing = 0;          ///< smallest distance of two places; 0: one place only
  /// Lower bound of thresholds: 0 on a linear scale if all levels are above 0, like sizes and
  /// stiffnesses; else -infinity.
  double least = -std::numeric_limits<double>::infinity();

  /// Slopes beyond these bounds are flat or a step at these levels.
  double least_log_slope() const;
  double most_log_slope() const;
};

PlacedData place_counts(const std::vector<LevelCount>& counts,
                        const protocols::PsychometricFunction& function);

/// Natural logarithm.
/// \param threshold  on the scale
double psychometric_log_likelihood(const PlacedData& data,
                                   const protocols::PsychometricFunction& function,
                                   double threshold, double slope, double guess, double lapse);

/// Search for a minimum: a grid; local searches start from its best points.
struct PsychometricSearch {
  int thresholds = 21, slopes = 19;
  std::size_t starts = 4;
};
/// For a fit, and for the refits of simulations.
inline constexpr PsychometricSearch kWholeSearch{}, kQuickSearch{11, 9, 1};

enum class PsychometricRate { guess, lapse };

/// Minus log likelihood over (threshold on the scale, log slope, free rates), with one or none of
/// them held. A free rate is most sin^2(x), always within 0 .. most.
class PsychometricObjective {
 public:
  /// Both must outlive it. One rate for both asymptotes is the lapse rate: hold that.
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

  /// The best point from a start, which has the coordinates of point() that are not held.
  SimplexMinimum best_from(const std::vector<double>& start, double step, double tolerance) const;
  /// The best point from the best grid points: the likelihood may have several maxima.
  SimplexMinimum best(const PsychometricSearch& search, double tolerance) const;
  /// With a parameter held: the best point of a grid, if it is far from `place`.
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
