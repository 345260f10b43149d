#pragma once
// Compares measures of movement between renderers for each shape, in the same way as response
// times.

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

/// The value on the scale of comparison; none: missing.
std::optional<double> on_scale(MeasureScale scale, const std::optional<double>& value);
/// The inverse of on_scale.
double from_scale(MeasureScale scale, double value);
/// "log", "log of value + 1", "logit", "value".
const char* scale_name(MeasureScale scale);

/// A measure over participants, from all trials with a value, correct or not.
struct MeasureComparison {
  std::size_t measure = 0;  ///< index into measure_definitions()
  /// Means of the participants' means on the scale, as mean_of_participant_mean_logs of times.
  Description description;
  std::vector<Comparison> comparisons;  ///< differences on the scale, without bootstrap
  MixedModel mixed_model;
};

/// Compares all measures. Holm's adjustment is over the shapes of a measure, as for times; not over
/// measures.
std::vector<MeasureComparison> compare_movement(const MovementTable& table);

/// Association of the gain in time with differences of movement. Not causal: the movements were not
/// manipulated. For one shape, one pair of renderers and one measure. Log times are compared within
/// participants: each participant's mean is subtracted from time, renderer and measure.
struct AdjustedGain {
  std::size_t shape = 0, comparison = 0, measure = 0;
  std::size_t n_trials = 0, n_participants = 0;
  std::optional<double> time_difference;     ///< of log time, renderer minus reference
  std::optional<double> measure_difference;  ///< on the measure's scale
  /// Of log time at equal measure: the renderer's coefficient, adjusted for the measure.
  std::optional<double> time_difference_at_equal_measure;
  std::optional<double> slope;  ///< of log time on the measure, at equal renderer
};

/// The measures of the table: coverage rate, strokes, share of contact.
std::vector<AdjustedGain> adjusted_gains(const MovementTable& table);

/// Everything that is reported of movement.
struct MovementAnalysis {
  MovementTable table;
  std::vector<MeasureComparison> measures;
  std::vector<AdjustedGain> gains;
  std::string program_version;
};

}  // namespace palpate::analysis
