#pragma once
// Makes the marks of figures.

#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"

namespace palpate::analysis {

Mark symbol(Role role, Shape shape, double x, double y, double size, std::string text = {});
Mark text_mark(Role role, double x, double y, std::string text, double size = 12);
Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width = 2);
Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text);

/// An interval, cut to the axis, with arrowheads where it leaves it.
void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text);
/// The same from left to right.
void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text);

/// Corners of the symbols that are told by them alone, right, cross, left and saltire; y down, the
/// half width 1. Empty: of the others.
std::vector<std::pair<double, double>> outline_of(Shape shape);

}  // namespace palpate::analysis
