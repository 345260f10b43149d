#pragma once
// One figure of every participant (a mean log time, a threshold, an exponent) under the conditions
// of the study: compared between groups of participants and between levels of factors within them.

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
  std::size_t group = 0;                      ///< index; 0 without groups
  std::vector<std::optional<double>> values;  ///< by cell, as of GroupedRow
};

/// All cells with a level of a factor.
struct DesignCondition {
  std::size_t factor = 0;  ///< index of the factor within participants
  std::size_t level = 0;
  bool operator==(const DesignCondition&) const = default;
};

/// The figures of a group under a condition, or over all cells.
struct GroupMarginal {
  std::size_t group = 0;
  std::optional<DesignCondition> condition;  ///< none: the mean over all cells
  std::size_t n = 0;
  std::optional<double> mean, se;
  std::optional<Interval> ci95;  ///< t over the group's participants
};

/// A difference of means. Between participants: a group minus the first one, of a mean or of the
/// difference of a condition from the first level of its factor (Welch 1947). Within a group: a
/// condition minus the first level of its factor (paired t).
struct GroupContrast {
  std::size_t group = 0;
  std::optional<DesignCondition> condition;  ///< none: the mean over all cells
  bool of_difference = false;                ///< condition minus the first level of its factor
  bool within = false;                       ///< of the group's own participants
  std::string undefined;
  std::size_t n_reference = 0, n = 0;
  std::optional<double> estimate, se, t, df, p;
  std::optional<Interval> ci95;
  std::optional<double> p_holm;  ///< over all contrasts of the figure of the same kind
};

struct BetweenGroups {
  MixedAnova anova;
  std::vector<std::size_t> dropped;  ///< rows that lack a value in some cell: not in the analysis
  std::vector<GroupMarginal> marginals;
  std::vector<GroupContrast> contrasts;  ///< between participants, then within groups
};

enum class WithinContrasts { left_out, added };

/// The compared value: the mean over all cells, that under each level of some factors, and the
/// differences of these from that under the first level.
struct ComparedConditions {
  std::vector<std::optional<DesignCondition>> means;
  std::vector<DesignCondition> differences;
};

/// \param shown  of the first that many factors
ComparedConditions compared_conditions(const std::vector<WithinFactor>& within, std::size_t shown);

/// Sets the p_holm of the contrasts, over those between participants and over those within groups.
void adjust_contrasts(std::vector<GroupContrast>& contrasts);

/// \param groups  number of groups; 1: none
BetweenGroups compare_groups(const std::vector<GroupedFigures>& figures, std::size_t groups,
                             const std::vector<WithinFactor>& within,
                             WithinContrasts contrasts = WithinContrasts::left_out);

/// Welch's t test: mean of `other` minus mean of `reference`. \param noise  a standard error that
/// is none
GroupContrast welch(const std::vector<double>& reference, const std::vector<double>& other,
                    double noise = 0);

/// Mean of the cells with a level of a factor, the levels of the first factor outermost.
double mean_of_condition(const std::vector<double>& cells, const std::vector<WithinFactor>& within,
                         const DesignCondition& condition);

}  // namespace palpate::analysis
