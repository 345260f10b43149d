#pragma once
// Thresholds, PSEs, JNDs, slopes, exponents and settings over participants: means, and comparisons
// within participants between renderers, or between blocks and stimuli of a task. Paired tests and
// mixed models.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// A figure of a participant under a condition, on the scale of the comparison: logarithms for
/// ratios.
struct ParticipantFigure {
  std::size_t participant = 0, condition = 0;
  double value = 0;
};

/// A condition minus the first one.
struct ConditionDifference {
  std::size_t condition = 0;
  /// Over participants with both.
  std::size_t n_pairs = 0;
  double mean = 0;
  TTest t_test;  ///< its interval is that of the difference; p_holm over the conditions
  EffectSize effect_size;
  Wilcoxon wilcoxon;
  /// From the mixed model, which also uses participants who lack one of the two.
  std::optional<double> mixed_estimate, mixed_se;
};

struct ThresholdComparison {
  std::string undefined;
  std::vector<ConditionDifference> differences;
  /// value ~ condition + (1 | participant), REML.
  std::optional<double> participant_sd, residual_sd;
};

/// \param conditions  number of conditions; each participant has at most one value in each
ThresholdComparison compare_thresholds(const std::vector<ParticipantFigure>& figures,
                                       std::size_t conditions);

struct TaskCell;

/// A figure of a participant, in its own unit.
struct NamedFigure {
  std::string participant;
  double value = 0;
  std::optional<Interval> ci95;  ///< of a fitted function; an open end is infinite or 0
};

/// The group's value with a renderer: the mean of the participants' figures, or the group's model
/// of all answers (see task_group.h).
struct GroupMean {
  std::string renderer;
  std::vector<NamedFigure> participants;
  std::size_t n_undetermined = 0;  ///< functions whose threshold is undetermined: left out
  std::optional<double> mean;      ///< none: nobody has a figure
  std::optional<double> sd;        ///< n - 1; of natural logarithms where the mean is geometric
  /// t over participants; none below two, or without variance. Of the model: an open end is
  /// infinite, none: not determined.
  std::optional<Interval> ci95;
  bool of_model = false;
  std::size_t n_of_model = 0;      ///< participants with trials
  std::vector<std::string> notes;  ///< of the model
};

/// A measure of a stimulus in a block, with each renderer.
struct TaskGroup {
  std::string task, block_name, shape;
  /// "threshold", "pse", "jnd", "weber_fraction", "exponent", "rating"; of a level of several
  /// dimensions its parameters, "w", "c", ...
  std::string measure;
  std::string unit;  ///< "N/m", ...; "": unknown, or without unit
  /// Means are geometric if all figures are positive and have a true zero, except for exponents.
  bool geometric = false;
  std::vector<GroupMean> renderers;  ///< point, ray, then others in order of their first trial
};

/// Natural logarithms if all figures are positive.
struct TaskComparison {
  std::string task;
  std::string measure;            ///< "threshold", "pse", "jnd", "exponent", "rating"
  std::string block_name, shape;  ///< of a comparison of renderers
  std::string renderer;           ///< of a comparison of blocks and stimuli
  /// Renderers, or "BLOCK, STIMULUS"; the first is the reference.
  std::vector<std::string> conditions;
  bool logarithms = false;
  std::size_t n_undetermined = 0;  ///< functions whose threshold is undetermined: left out
  /// Tests that p_holm is adjusted over: the differences; of ratings, all of the block.
  std::size_t n_tests = 0;
  ThresholdComparison comparison;
};

/// Whether a measure is a parameter of a function of several dimensions: "w", "c", ...
bool is_field_parameter(const std::string& measure);

/// "Thresholds", "PSEs", "JNDs", "Weber fractions", "Exponents", "Mean ratings", "w values".
std::string measure_plural(const std::string& measure);

/// Means over participants, for each measure with a value.
std::vector<TaskGroup> group_results(const std::vector<TaskCell>& cells);
/// Compares renderers within a block and stimulus; the reference is point, or else the renderer of
/// the first trial.
std::vector<TaskComparison> compare_renderers(const std::vector<TaskCell>& cells);
/// Compares blocks and stimuli of a task with a renderer, if they have the same standard. Ratings:
/// the stimuli of a block, each with each up to kMostPaired of them, else with the first.
constexpr std::size_t kMostPaired = 20;
std::vector<TaskComparison> compare_conditions(const std::vector<TaskCell>& cells);

}  // namespace palpate::analysis
