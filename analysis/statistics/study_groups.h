#pragma once
// The measures of a study compared between its groups of participants: times and accuracy of
// identification, and the figures of each task.

#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/mixed_model.h"

namespace palpate::analysis {

struct StudyAnalysis;

/// A measure by group.
struct GroupedMeasure {
  /// "time", "accuracy"; of tasks "pse", "jnd", "threshold", "exponent", "rating", ...
  std::string measure;
  std::string task, block_name, shape;  ///< of tasks; "": over all
  std::string unit;                     ///< of the figures, whatever the scale; "": none
  bool logarithms = false;              ///< natural logarithms are compared: ratios
  std::vector<std::string> groups;      ///< the first is the reference
  std::vector<std::string> renderers;   ///< likewise
  std::vector<GroupedFigures> figures;  ///< of every participant, by renderer, then shape
  BetweenGroups result;
  /// Of the logarithms of single times; none: another measure.
  std::optional<GroupedMixedModel> model;
};

/// Empty: the study has no groups.
std::vector<GroupedMeasure> between_groups(const StudyAnalysis& analysis);

}  // namespace palpate::analysis
