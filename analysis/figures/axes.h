#pragma once

#include <cstddef>
#include <string_view>

#include "analysis/figures/svg.h"

namespace palpate::analysis {

constexpr std::string_view kInk = "#1f2328", kSoft = "#59636e", kGrid = "#e3e6ea";

/// The frame of one panel with a slot for each shape; maps values to px, cut to what is shown.
struct Axes {
  double left = 0, width = 0, top = 0, bottom = 0;  ///< px
  double low = 0, high = 1;                         ///< values at bottom and top, low < high
  double step = 1;                                  ///< between ticks
  double slot = 0;                                  ///< px for each shape

  double y(double value) const;
  double centre(std::size_t shape) const;
  /// Widens low and high to whole ticks of 1, 2 or 5 times a power of ten.
  void round_ends();
};

/// Lines and figures of the ticks; the line at 0 is stronger.
void draw_grid(Svg& svg, const Axes& axes);
/// An interval with end caps; arrowheads where it leaves the axes.
void draw_interval(Svg& svg, const Axes& axes, double x, double low, double high,
                   std::string_view colour);

}  // namespace palpate::analysis
