#pragma once
// `palpate plan --cues`: what a study of seen and felt cues can and cannot show.

#include <boost/program_options.hpp>
#include <string>

#include "runner/commands/plan/plan.h"
#include "runner/output/outputs.h"

namespace palpate::runner::commands {

/// Simulates and prints the plan, and writes it as JSON if that is wanted.
/// \param weber  "FELT,SEEN"
/// \return the exit status: 1 where no gain can be promised \throws UsageError
int print_cue_plan(const std::string& weber, const PlanOptions& options,
                   const boost::program_options::variables_map& values, output::Outputs& outputs);

}  // namespace palpate::runner::commands
