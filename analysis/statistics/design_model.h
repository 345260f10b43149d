#pragma once
// Linear mixed model of single times by the design of a study: groups of participants, and
// renderers, factors and shapes within them. REML, like R's lme4 and lmerTest.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/model_estimate.h"

namespace palpate::analysis {

/// The times of a study whose participants are each in one group and meet all conditions.
struct DesignedTimes {
  /// [condition][shape][participant], the levels of the first factor outermost
  ParticipantCells cells;
  std::vector<WithinFactor> conditions;  ///< what the conditions cross: "renderer", "lag"
  std::size_t shapes = 1;
  std::vector<std::size_t> group_of;  ///< of each participant; >= groups: left out
  std::size_t groups = 1;             ///< 1: none
};

/// Mean log time of a group under a condition, or over all; over shapes.
struct ModelMean {
  std::size_t group = 0;
  std::optional<DesignCondition> condition;
  ModelEstimate value;
};

/// Of times log(time) ~ group * conditions * shape + (1 + conditions | participant); of figures see
/// weighted_model.h.
struct DesignModel {
  std::string undefined;  ///< reason if there is no fit; empty: fitted
  bool weighted = false;  ///< of figures with standard errors; else of single times
  std::string singular;   ///< what does not vary although no slope is left; empty: all do
  std::size_t n_observations = 0, n_participants = 0;
  /// Effects that participants differ in besides their level: "renderer", "lag", "renderer:lag".
  std::vector<std::string> slopes;
  /// In the order in which they were taken out: the interaction of most factors first, of those
  /// alike that of the last factors, until the fit converges and no variance is singular. At once:
  /// what has more effects than participants can tell.
  std::vector<std::string> taken_out;
  /// Type III, "group", "renderer", "group:renderer", "lag", ...
  std::vector<GroupEffect> effects;
  std::vector<ModelMean> means;          ///< estimated marginal means, as those of BetweenGroups
  std::vector<GroupContrast> contrasts;  ///< of these, as those of BetweenGroups
  /// Of weighted figures: standard deviation of participants, and that of what is common to all
  /// figures besides the error of each.
  std::optional<double> participant_sd, common_sd;
  /// Undetermined figures and those without a standard error: left out.
  std::size_t n_without_error = 0;
};

/// \param contrasts  within groups as well
DesignModel design_model(const DesignedTimes& times, WithinContrasts contrasts);

}  // namespace palpate::analysis
