#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/svg.h"

namespace palpate::runner {

/// The frame of one panel with logarithmic axes; maps values to px, cut to what is shown.
struct LogPanel {
  double left = 0, top = 0, width = 0, height = 0;        ///< px
  double x_low = 1, x_high = 10, y_low = 1, y_high = 10;  ///< values, above 0

  double x(double value) const;
  double y(double value) const;
  /// Widens both ranges to whole decades.
  void round_ends();
};

struct PanelTitles {
  std::string panel, x, y;  ///< y empty: none
};

/// Frame, a grid line and figure for each decade (fewer figures where there are many), titles.
void draw_panel(analysis::Svg& svg, const LogPanel& panel, const PanelTitles& titles);
/// A line from point to point.
void draw_path(analysis::Svg& svg, const LogPanel& panel,
               const std::vector<std::pair<double, double>>& points, std::string_view colour,
               double width);
/// A dashed line across the panel at a level, with its name above it at the right; empty: none.
void draw_level(analysis::Svg& svg, const LogPanel& panel, double level, std::string_view name);

}  // namespace palpate::runner
