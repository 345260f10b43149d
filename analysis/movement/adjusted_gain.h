#pragma once
// How the gain in time goes together with differences of movement. A description of trials, not of
// causes: nobody set the movements.

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/movement/comparison.h"

namespace palpate::analysis {

/// Of one shape, one pair of renderers and one measure. Logs of time are compared within
/// participants: each participant's mean is taken off time, renderer and measure.
struct AdjustedGain {
  std::size_t shape = 0, comparison = 0, measure = 0;
  std::size_t n_trials = 0, n_participants = 0;
  std::optional<double> time_difference;     ///< of log time, the renderer minus the reference
  std::optional<double> measure_difference;  ///< on the measure's scale
  /// Of log time at equal measure: the renderer's coefficient beside the measure's.
  std::optional<double> time_difference_at_equal_measure;
  std::optional<double> slope;  ///< of log time on the measure, at equal renderer
};

/// The measures of the table: coverage by time, strokes, share of contact.
std::vector<AdjustedGain> adjusted_gains(const MovementTable& table);

}  // namespace palpate::analysis
