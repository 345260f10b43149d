#pragma once
// The JSON report.

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis as JSON; the keys are described in analysis/README.md. Numbers have 17 significant
/// digits; an undefined one is null beside "status": "undefined" and a "reason".
std::string report_json(const Analysis& analysis);

}  // namespace palpate::analysis
