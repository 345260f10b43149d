#pragma once

#include <string>

#include "runner/commands/shared/outputs.h"

namespace palpate::runner {

/// `palpate analyze --sweep`: the analysis as text; puts what was asked for into `outputs`, which
/// are not written yet. \throws UsageError: the file is no sweep's, or the pattern is none
std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               Outputs& outputs);

}  // namespace palpate::runner
