#pragma once
// The likelihood that the fits of psychometric functions share.

#include <limits>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// Counts with their levels' places on the scale.
struct PlacedCount {
  double place = 0;
  double trials = 0, successes = 0;
};

struct PlacedData {
  std::vector<PlacedCount> counts;
  std::vector<double> places;  ///< finite ones, each once, in order
  double low = 0, high = 0;    ///< the first and the last
  double spacing = 0;          ///< smallest distance of two places; 0: one place only
  /// No threshold is below: 0 on a linear scale of levels that are all above 0, as those of sizes
  /// and stiffnesses are; else -infinity.
  double least = -std::numeric_limits<double>::infinity();

  /// Slopes beyond are flat or a step, as far as these levels can tell.
  double least_log_slope() const;
  double most_log_slope() const;
};

PlacedData place_counts(const std::vector<LevelCount>& counts,
                        const protocols::PsychometricFunction& function);

/// Natural logarithm. \param threshold on the scale
double psychometric_log_likelihood(const PlacedData& data,
                                   const protocols::PsychometricFunction& function,
                                   double threshold, double slope, double guess, double lapse);

}  // namespace palpate::analysis
