#pragma once
// Figures of a sweep.

#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/sweep_analysis.h"

namespace palpate::analysis {

/// gains: each shape's over the space, beside the paper's; drivers: what they depend on most;
/// scatter: each shape's gain over its strongest driver. Those that the data allow.
std::vector<Figure> sweep_figures(const SweepAnalysis& analysis);

/// "Sobol index" or "rank correlation".
std::string driver_measure(const SweepAnalysis& analysis);

/// Parameters that figures and tables show of each shape.
constexpr std::size_t kShownDrivers = 8;

}  // namespace palpate::analysis
