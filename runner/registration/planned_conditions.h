#pragma once
// Where a plan's effect is in a protocol: the blocks that give its measure, and the conditions that
// differ.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/report/plan_record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::runner::registration {

struct PlannedConditions {
  std::vector<int> blocks;  ///< indices; empty: no block gives the measure
  /// The second condition is the ray; otherwise every stimulus and block but the first one.
  bool by_renderer = false;
  bool differ = false;     ///< there are two conditions
  int first_stimulus = 0;  ///< index into Protocol::stimuli, of the first block

  /// Whether a trial of these blocks is of the second condition.
  bool is_second(const protocols::Trial& trial) const;
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
