#pragma once
// One panel of a figure as SVG: axes and marks. Internal to analysis/figures/.

#include "analysis/figures/figures.h"
#include "analysis/figures/palette.h"
#include "analysis/figures/svg.h"

namespace palpate::analysis {

/// A panel at its position in the drawing: px from the upper left corner, y down. x() and y()
/// convert from axis units.
struct PlacedPanel {
  const Panel* panel = nullptr;
  double left = 0, top = 0;  ///< of the area that the axes span
  double width = 0;          ///< of the frame; its height is the panel's

  double x(double value) const {
    return left + (value - panel->x.low) / (panel->x.high - panel->x.low) * width;
  }
  double y(double value) const {
    return top + panel->height -
           (value - panel->y.low) / (panel->y.high - panel->y.low) * panel->height;
  }
};

/// px that the left axis with its labels and title takes.
double left_axis_width(const Panel& panel);

/// \return px that the lower axis with its labels and title takes
double draw_axes(Svg& svg, const PlacedPanel& placed, const Palette& palette);
void draw_marks(Svg& svg, const PlacedPanel& placed, const Palette& palette);

/// A symbol centred at (x, y). \param half half of its width, px
void draw_symbol(Svg& svg, const Palette& palette, MarkerShape shape, Role role, double x, double y,
                 double half, double opacity = 1);

}  // namespace palpate::analysis
