#pragma once
// The part of 'palpate plan' that is about thresholds.

#include "runner/commands/plan/options.h"
#include "runner/commands/shared/outputs.h"

namespace palpate::runner {

struct ThresholdOptions {
  double effect = 0, weber = 0.1, participant_sd = 0.3, effect_sd = 0.2, pse_sd = 0.5, reach = 2.5;
};
void add_threshold_options(CommandLine& line, ThresholdOptions& options);
/// Prints the plan, and writes its JSON. \throws UsageError
void plan_thresholds_of(const ThresholdOptions& thresholds, const PlanOptions& options,
                        const boost::program_options::variables_map& values, Outputs& outputs);

/// Prints how often the intervals of thresholds hold the truth, and writes its JSON.
/// \throws UsageError
void print_coverage(const PlanOptions& options, const boost::program_options::variables_map& values,
                    Outputs& outputs);

}  // namespace palpate::runner
