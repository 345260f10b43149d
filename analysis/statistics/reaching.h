#pragma once
// Movements to targets: deviations over the trials, and what the hand has learnt.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::analysis {

/// A measure of a movement, and how many trials of its block the participant had before.
struct ReachPoint {
  double trial = 0;
  double value = 0;
};

/// value = end + (start - end) exp(-trial / trials), by least squares.
struct LearningFit {
  std::string undefined;  ///< reason; empty: there is a fit
  double start = 0, end = 0;
  double trials = 0;       ///< in which a share of 1 - 1/e is learnt
  double residual_sd = 0;  ///< about the fit
};

/// Undefined: fewer than kLeastPoints points, no course over the trials (an exponential explains no
/// more than a tenth of the variance), or one that is faster or slower than the trials show.
inline constexpr std::size_t kLeastPoints = 8;
LearningFit fit_learning(const std::vector<ReachPoint>& points);

inline constexpr std::size_t kDrawnPaths = 4;

/// The movements of a participant in a block, in order.
struct Reaches {
  std::size_t participant = 0;
  std::size_t trials = 0, in_time = 0;                         ///< with an answer; right ones
  std::vector<ReachPoint> deviations;                          ///< m, at peak speed, with the field
  std::vector<ReachPoint> catches;                             ///< likewise, in catch trials
  std::vector<ReachPoint> adaptations;                         ///< of clamp trials
  std::optional<double> deviation;                             ///< m, mean
  std::optional<double> catch_deviation;                       ///< m, mean
  std::optional<double> adaptation;                            ///< mean
  std::optional<double> duration, path_ratio, endpoint_error;  ///< s, 1, m: means, with the field
  /// m, of the first and of the last movements with the field, kDrawnPaths of each; empty: unknown.
  std::vector<std::vector<Vec3>> first_paths, last_paths;
  LearningFit learning;  ///< of `deviations`
};

}  // namespace palpate::analysis
