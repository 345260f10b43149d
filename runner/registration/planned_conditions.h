#pragma once
// Where a plan's effect is in a protocol: the blocks that give its measure, and the conditions that
// differ.

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "analysis/report/plan_record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::runner::registration {

struct PlannedConditions {
  std::vector<int> blocks;  ///< indices; empty: no block gives the measure
  /// The second condition is the ray; else every level but the first one of a factor; else every
  /// stimulus and block but the first one. With another contrast (threshold_plan.h) it is the
  /// second group, or every trial.
  bool by_renderer = false;
  analysis::PlannedContrast contrast = analysis::PlannedContrast::conditions;
  std::string factor;           ///< the first one that a block crosses; "": none, or by renderer
  bool differ = false;          ///< there is something to compare
  std::set<int> first_stimuli;  ///< of the first condition, where it is not a renderer's

  /// Whether a trial of these blocks is of the second condition.
  /// \param group  index of the participant's
  bool is_second(const protocols::Trial& trial, std::size_t group) const;
};
PlannedConditions conditions_of(const protocols::Protocol& protocol,
                                const analysis::PlanRecord& plan);

/// The curve for so many trials. \pre the plan fits the protocol
const analysis::PlanRecord::Curve& fitting_curve(const protocols::Protocol& protocol,
                                                 const analysis::PlanRecord& plan);

/// Requires a plan for a measure, shapes and trials that the protocol has. \throws UsageError
void require_fitting(const analysis::PlanRecord& plan, const std::string& path,
                     const protocols::Protocol& protocol);

}  // namespace palpate::runner::registration
