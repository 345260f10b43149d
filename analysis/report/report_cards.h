#pragma once

#include <string>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// The reductions at the top of a page: a card for each shape, a row of cards for each comparison.
void put_cards(std::string& out, const Analysis& analysis);

}  // namespace palpate::analysis
