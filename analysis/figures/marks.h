#pragma once
// Constructors of marks. Coordinates in the units of the axes, sizes in px.

#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

Mark symbol(Role role, MarkerShape shape, double x, double y, double size, std::string text = {});
Mark text_mark(Role role, double x, double y, std::string text, double size = 12);
Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width = 2);
Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text);

/// Vertical interval with end caps; where it extends beyond the axis it is cut, with an arrowhead.
void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text);
/// The same, horizontal.
void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text);

/// Corners of right, left, cross and saltire within -1 to 1, y down; empty for the other shapes.
std::vector<std::pair<double, double>> outline_of(MarkerShape shape);

}  // namespace palpate::analysis
