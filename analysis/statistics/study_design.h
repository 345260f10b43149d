#pragma once
// The measures of a study by its design: compared between groups of participants and between the
// cells of crossed factors. Times and accuracy of identification, and the figures of each task.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/study_table.h"
#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/design_model.h"

namespace palpate::analysis {

struct StudyAnalysis;

/// A measure by group and by the factors within participants.
struct GroupedMeasure {
  /// "time", "accuracy"; of tasks "pse", "jnd", "threshold", "exponent", "rating", ...
  std::string measure;
  std::string task, block_name, shape;  ///< of tasks; "": over all
  std::string unit;                     ///< of the figures, whatever the scale; "": none
  bool logarithms = false;              ///< natural logarithms are compared: ratios
  std::vector<std::string> groups;      ///< the first is the reference; empty: no groups
  /// The first is the renderer, then the factors, then, of identification, the shape; the first
  /// level of each is the reference.
  std::vector<StudyFactor> within;
  bool crossed = false;                 ///< there are factors besides renderer and shape
  std::vector<GroupedFigures> figures;  ///< of every participant, the cells of `within` in order
  BetweenGroups result;
  /// Of the logarithms of single times, or of figures with standard errors of their own (PSEs,
  /// thresholds, JNDs); none: another measure.
  std::optional<DesignModel> model;
};

std::vector<WithinFactor> factor_sizes(const std::vector<StudyFactor>& within);

/// A participant's group, 0 without groups; none: the groups leave the participant out.
std::optional<std::size_t> known_group(const GroupLabels& labels, const std::string& participant);

/// Whether an effect belongs to the family that the protocols name. \param tests  empty: all do
bool is_tested(const std::vector<std::string>& tests, const std::string& effect);

/// Empty: the study has neither groups nor factors.
std::vector<GroupedMeasure> measures_by_design(const StudyAnalysis& analysis);

}  // namespace palpate::analysis
