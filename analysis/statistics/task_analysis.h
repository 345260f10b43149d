#pragma once
// What was found with each task of a study of version 2, by block, stimulus and renderer.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/task_trials.h"
#include "analysis/statistics/information.h"
#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/scaling.h"
#include "analysis/statistics/signal_detection.h"
#include "analysis/statistics/threshold_comparison.h"

namespace palpate::analysis {

/// A psychometric function of a participant.
struct ParticipantFunction {
  std::string participant;
  std::vector<LevelCount> counts;  ///< by level
  PsychometricModel model;
  PsychometricFit fit;
  GoodnessOfFit goodness;
  Discrimination discrimination;
  /// The levels in the order in which they were shown, of the first track with more than one.
  std::vector<double> track;
  Detectability detectability;  ///< detect with catch trials; else undefined
};

/// All trials of one task with a stimulus and a renderer in a block.
struct TaskCell {
  std::string task, block_name, shape, renderer;
  std::size_t trials = 0, answered = 0, correct = 0;
  std::optional<double> standard_level;
  /// The answer depends on which is the stronger of two, so that half of the answers succeed
  /// without a difference: all levels lie on one side of the standard (compare).
  bool forced_choice = false;
  std::vector<std::string> participants;           ///< that `magnitude`, `adjustments` number
  std::vector<ParticipantFunction> functions;      ///< compare, detect
  std::optional<MagnitudeEstimation> magnitude;    ///< rate
  std::vector<Adjustment> adjustments;             ///< adjust
  std::optional<InformationTransfer> information;  ///< identify: over all its stimuli
  Type2Roc confidence;                             ///< undefined: nobody was asked
};

/// Thresholds with the renderers of a block and stimulus, natural logarithms where all are
/// positive.
struct RendererComparison {
  std::string block_name, shape;
  std::vector<std::string> renderers;  ///< the first is the reference
  bool logarithms = false;
  ThresholdComparison comparison;
};

struct TaskAnalysis {
  TaskTable table;
  std::vector<TaskCell> cells;
  std::vector<RendererComparison> comparisons;
};

/// \param simulations  of each goodness of fit
TaskAnalysis analyze_tasks(TaskTable table, int simulations, std::uint64_t seed);

}  // namespace palpate::analysis
