#pragma once
// One figure of every participant (a mean log time, a threshold, an exponent) under the conditions
// of the study, compared between groups of participants.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/mixed_anova.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// A participant's figures; none: undetermined.
struct GroupedFigures {
  std::string participant;
  std::size_t group = 0;                      ///< index
  std::vector<std::optional<double>> values;  ///< by cell, as of GroupedRow
};

/// The figures of a group under a condition of the first factor, or over all conditions.
struct GroupMarginal {
  std::size_t group = 0;
  std::optional<std::size_t> condition;  ///< none: the mean over all cells
  std::size_t n = 0;
  std::optional<double> mean, se;
  std::optional<Interval> ci95;  ///< t over the group's participants
};

/// A group minus the first one: a mean, or the difference of a condition from the first condition.
struct GroupContrast {
  std::size_t group = 0;
  std::optional<std::size_t> condition;  ///< of the first factor; none: the mean over all cells
  bool of_difference = false;            ///< condition minus the first condition
  std::string undefined;
  std::size_t n_reference = 0, n = 0;
  std::optional<double> estimate, se, t, df, p;  ///< Welch (1947)
  std::optional<Interval> ci95;
  std::optional<double> p_holm;  ///< over all contrasts of the figure
};

struct BetweenGroups {
  MixedAnova anova;
  std::vector<std::size_t> dropped;  ///< rows that lack a value in some cell: not in the analysis
  std::vector<GroupMarginal> marginals;
  std::vector<GroupContrast> contrasts;
};

/// \param groups  number of groups
BetweenGroups compare_groups(const std::vector<GroupedFigures>& figures, std::size_t groups,
                             const std::vector<WithinFactor>& within);

/// Welch's t test: mean of `other` minus mean of `reference`.
GroupContrast welch(const std::vector<double>& reference, const std::vector<double>& other);

}  // namespace palpate::analysis
