#pragma once
// The text report.

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis for a terminal: the conclusion, then warnings and tables. UTF-8, at most 100
/// columns; long names are shortened, wide tables are split.
std::string report_text(const Analysis& analysis);

}  // namespace palpate::analysis
