#pragma once
// Axes of panels: their ends, ticks and labels.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// Slots 0..1, 1..2, ... named in their middles; the first `shown` of the names.
FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title);
/// Round ticks, ends widened to them.
FigureAxis linear_axis(double low, double high, std::string title);
/// For log10 of values: ticks at 1, 2 and 5 times powers of ten, over several decades at the powers
/// alone, over many at every second or third. \param low, high log10 of values
FigureAxis log_axis(double low, double high, std::string title);
/// The same with ends at whole powers of ten. \param low, high values, above 0
FigureAxis decades_axis(double low, double high, std::string title);

}  // namespace palpate::analysis
