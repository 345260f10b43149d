#pragma once
// `palpate plan --groups`: participants of each group that find that groups differ.

#include <boost/program_options.hpp>

#include "runner/commands/plan/plan.h"
#include "runner/output/outputs.h"

namespace palpate::runner::commands {

struct GroupOptions {
  int groups = 2;
  double between = 0, interaction = 0;  ///< percent
};

void add_group_options(CommandLine& line, GroupOptions& options);

/// Simulates and prints the plan, and writes it as JSON if that is wanted. \throws UsageError
void print_group_plan(const GroupOptions& groups, const PlanOptions& options,
                      const boost::program_options::variables_map& values,
                      output::Outputs& outputs);

}  // namespace palpate::runner::commands
