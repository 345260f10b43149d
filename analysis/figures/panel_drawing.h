#pragma once
// One panel of a figure as SVG: axes and marks. Internal to analysis/figures/.

#include "analysis/figures/figures.h"
#include "analysis/figures/palette.h"
#include "analysis/figures/svg.h"

namespace palpate::analysis {

/// A panel at its place in a drawing: px from the drawing's upper left corner, y down.
struct PlacedPanel {
  const Panel* panel = nullptr;
  double left = 0, top = 0;  ///< of the frame that the axes span
  double width = 0;          ///< of the frame; its height is the panel's

  double x(double value) const {
    return left + (value - panel->x.low) / (panel->x.high - panel->x.low) * width;
  }
  double y(double value) const {
    return top + panel->height -
           (value - panel->y.low) / (panel->y.high - panel->y.low) * panel->height;
  }
};

/// Room that a panel's left axis takes, px.
double left_room(const Panel& panel);

/// \return room that the lower axis takes, px
double draw_axes(Svg& svg, const PlacedPanel& placed, const Palette& palette);
void draw_marks(Svg& svg, const PlacedPanel& placed, const Palette& palette);

/// A symbol around (x, y), px.
void draw_symbol(Svg& svg, const Palette& palette, Shape shape, Role role, double x, double y,
                 double half, double opacity = 1);

}  // namespace palpate::analysis
