#pragma once
// Figures of a sweep.

#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/sweep_analysis.h"

namespace palpate::analysis {

/// gains: each shape's gain over the space, with the paper's; drivers: their strongest drivers;
/// scatter: each shape's gain over its strongest driver. Only figures with data.
std::vector<Figure> sweep_figures(const SweepAnalysis& analysis);

/// "Sobol index" or "rank correlation".
std::string driver_measure(const SweepAnalysis& analysis);

/// Number of parameters shown for each shape in figures and tables.
constexpr std::size_t kShownDrivers = 8;

}  // namespace palpate::analysis
