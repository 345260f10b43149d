#pragma once

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The analysis for a terminal: the answer first, then the tables. UTF-8, lines of at most 100
/// columns; long names are shortened, wide tables are split.
std::string report_text(const Analysis& analysis);

}  // namespace palpate::analysis
