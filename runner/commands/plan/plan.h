#pragma once
// The options of 'palpate plan' and the model that they describe.

#include <boost/program_options.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/statistics/pilot.h"
#include "analysis/statistics/plan.h"
#include "analysis/statistics/power.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner::commands {

struct PlanOptions {
  std::string database, csv, protocol, effect, participants = "2-100", trials = "10,20,40,76",
                                               goal = "all", test = "paired", json, figure;
  double gain_sd = 0, shape_gain_sd = 0, intercept_sd = 0.3, correlation = 0, residual_sd = 0,
         share_used = 1, power = 0.8, alpha = 0.05;
  std::string studies, jobs;
  std::uint64_t seed = 2000;
  std::vector<std::string> reuse;  ///< files of earlier plans
};

/// The options that a plan's powers depend on.
void add_plan_options(CommandLine& line, PlanOptions& options);

/// The pilot's model, or the paper's shapes with the given figures. \throws UsageError
analysis::Pilot starting_point(const PlanOptions& options,
                               const boost::program_options::variables_map& values);

/// The pilot's model, moved from, with the given figures and effects. \throws UsageError
analysis::StudyModel model_of(analysis::Pilot& pilot, const PlanOptions& options,
                              const boost::program_options::variables_map& values);

/// \throws UsageError
analysis::PlanSettings settings_of(const PlanOptions& options,
                                   const boost::program_options::variables_map& values);

}  // namespace palpate::runner::commands
