#pragma once
// Axes of panels: range, ticks and tick labels.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

/// Categorical axis: slot i spans i to i + 1 and has its name in the middle. \param shown how many
/// of the names
FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title);
/// Linear axis with ticks at multiples of 1, 2 or 5 times a power of ten; its ends are ticks, at or
/// beyond low and high.
FigureAxis linear_axis(double low, double high, std::string title);
/// Logarithmic axis: positions are log10 of the values. Ticks at 1, 2 and 5 times powers of ten;
/// above 3.5 decades at powers of ten only, above 9 decades at every second, third ... power.
/// \param low, high log10 of values
FigureAxis log_axis(double low, double high, std::string title);
/// The same with ends at whole powers of ten. \param low, high values, above 0
FigureAxis decades_axis(double low, double high, std::string title);

}  // namespace palpate::analysis
