#pragma once

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis as JSON, its keys as in report_json.cpp: numbers read back exactly; an undefined
/// one is null, beside "status": "undefined" and a "reason".
std::string report_json(const Analysis& analysis);

}  // namespace palpate::analysis
