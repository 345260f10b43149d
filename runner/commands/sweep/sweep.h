#pragma once

#include <string>

#include "runner/commands/shared/outputs.h"

namespace palpate::runner::commands {

/// `palpate analyze --sweep`: the analysis as text; puts the requested files into `outputs` without
/// writing them. \throws UsageError: the file is not a sweep's, or the pattern is invalid
std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               Outputs& outputs);

}  // namespace palpate::runner::commands
