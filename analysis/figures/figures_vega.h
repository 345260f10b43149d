#pragma once
// Figures for Vega, the library that draws them in a browser.

#include <nlohmann/json_fwd.hpp>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// A Vega 5 specification that its interpreter of expressions can run; colours are
/// page_palette()'s. Signals that a page sets: `room` (px there are in width), `chosen` (the
/// participant whose marks stand out; empty: nobody).
nlohmann::ordered_json vega_spec(const Figure& figure);

}  // namespace palpate::analysis
