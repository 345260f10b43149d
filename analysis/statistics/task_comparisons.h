#pragma once
// What the same participants have under several renderers, or in several blocks and with several
// stimuli of a task: thresholds, JNDs, exponents, settings. Paired and mixed
// (threshold_comparison.h).

#include <string>
#include <vector>

#include "analysis/statistics/threshold_comparison.h"

namespace palpate::analysis {

struct TaskCell;

/// Natural logarithms where all figures are positive.
struct TaskComparison {
  std::string task;
  std::string measure;            ///< "threshold", "pse", "jnd", "exponent"
  std::string block_name, shape;  ///< of a comparison of renderers
  std::string renderer;           ///< of a comparison of blocks and stimuli
  /// Renderers, or "BLOCK, STIMULUS"; the first is the reference.
  std::vector<std::string> conditions;
  bool logarithms = false;
  std::size_t n_undetermined = 0;  ///< functions whose threshold the data do not tell: left out
  ThresholdComparison comparison;
};

/// In a block with a stimulus, where there are several renderers.
std::vector<TaskComparison> compare_renderers(const std::vector<TaskCell>& cells);
/// With a renderer, where a task has several blocks or stimuli whose levels are of one kind: the
/// standard is the same.
std::vector<TaskComparison> compare_conditions(const std::vector<TaskCell>& cells);

}  // namespace palpate::analysis
