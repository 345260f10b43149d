#pragma once
// Measures of movement compared between renderers, shape by shape, as response times are.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/movement/measures.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"

namespace palpate::analysis {

/// The trials of a study with their measures.
struct MovementTable {
  TrialTable trials;                           ///< without practice
  std::vector<MeasureValues> values;           ///< of each of trials.rows
  std::map<std::string, std::size_t> missing;  ///< trials without any value, by reason
  MovementSettings settings;
};

/// On the scale of comparison; none: missing.
std::optional<double> on_scale(MeasureScale scale, const std::optional<double>& value);
/// The inverse of on_scale.
double from_scale(MeasureScale scale, double value);
/// "log", "log of value + 1", "logit", "value".
const char* scale_name(MeasureScale scale);

/// A measure over participants: of all trials that have a value, right or wrong.
struct MeasureComparison {
  std::size_t measure = 0;  ///< index into measure_definitions()
  /// Means of the participants' means on the scale: times' mean_of_participant_mean_logs.
  Description description;
  std::vector<Comparison> comparisons;  ///< differences on the scale, without bootstrap
  MixedModel mixed_model;
};

/// All measures. Holm's adjustment is over the shapes of a measure, as with times; not over
/// measures.
std::vector<MeasureComparison> compare_movement(const MovementTable& table);

// How the gain in time goes together with differences of movement. A description of trials, not of
// causes: nobody set the movements.

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
