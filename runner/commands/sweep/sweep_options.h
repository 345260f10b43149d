#pragma once
// The options that determine the results of a sweep, and its analysis.

#include <string>

#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/sweep/planned_sweep.h"

namespace palpate::runner::commands {

void add_sweep_options(CommandLine& line, sweep::SweepSettings& settings);
/// Call it with the result of CommandLine::parse. \throws UsageError
void check_sweep_options(const boost::program_options::variables_map& values,
                         sweep::SweepSettings& settings);

/// `palpate analyze --sweep`: the analysis as text; puts the requested files into `outputs` without
/// writing them. \throws UsageError: the file is not a sweep's, or the pattern is invalid
std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               output::Outputs& outputs);

}  // namespace palpate::runner::commands
