#pragma once
// The percent reductions at the top of a report.

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// Appends a row of cards for each comparison, a card for each shape: reduction, interval, p and
/// the paper's percentage.
void put_reduction_cards(std::string& out, const Analysis& analysis);

}  // namespace palpate::analysis
