#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/svg.h"
#include "runner/commands/shared/log_panel.h"
#include "runner/commands/stability/report.h"

namespace palpate::runner {
namespace {

// Okabe & Ito's colours.
constexpr std::array<std::string_view, 8> kColours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                      "#E69F00", "#56B4E9", "#1f2328", "#8C8C8C"};
constexpr double kLeastDamping = 1e-4, kLeastError = 1e-19;

void draw_boundaries(analysis::Svg& svg, LogPanel panel,
                     const std::vector<const BoundaryCurve*>& curves, const std::string& title,
                     bool first) {
  draw_panel(svg, panel, {title, "stiffness K, N/m", first ? "damping b of each end, N s/m" : ""});
  double y = panel.top + 18;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string_view colour = kColours[i % kColours.size()];
    std::vector<std::pair<double, double>> theory;
    for (const BoundaryPoint& p : curves[i]->points) {
      if (p.promised) theory.emplace_back(p.stiffness, std::max(p.theory, kLeastDamping));
    }
    draw_path(svg, panel, theory, colour, 1.4);
    for (const BoundaryPoint& p : curves[i]->points) {
      const double x = panel.x(p.stiffness);
      if (p.measured > 0) {
        svg.circle(x, panel.y(p.measured), 3.5, colour);
      } else {
        svg.triangle(x, panel.top + panel.height - 4, 3.5, false, colour);  // stable without any
      }
    }
    svg.circle(panel.left + 12, y - 4, 3.5, colour);
    svg.text(panel.left + 21, y, curves[i]->name,
             {11, analysis::kInk, analysis::Svg::Anchor::start, false, 0});
    y += 15;
  }
}

}  // namespace

std::string stability_figure(const StabilityReport& report) {
  std::vector<std::pair<std::string, std::vector<const BoundaryCurve*>>> panels;
  for (const BoundaryCurve& curve : report.curves) {
    if (panels.empty() || panels.back().first != curve.panel) panels.push_back({curve.panel, {}});
    panels.back().second.push_back(&curve);
  }
  constexpr double kPanel = 316, kHeight = 250, kLeft = 66, kGap = 62, kTop = 104, kBetween = 92;
  constexpr std::size_t kColumns = 3;
  const std::size_t rows = (panels.size() + kColumns - 1) / kColumns;
  const double width = kLeft + kColumns * kPanel + (kColumns - 1) * kGap + 24;
  const double height = kTop + static_cast<double>(rows) * (kHeight + kBetween) - 36;
  analysis::Svg svg;
  svg.rect(0, 0, width, height, "#ffffff");
  svg.text(16, 30, "A stiffer wall needs more damping: lines are the theory, dots the loop",
           {18, analysis::kInk, analysis::Svg::Anchor::start, true, 0});
  svg.text(
      16, 53,
      "Below a line no hand can make it buzz. A dot on or under its line is on the safe side; a "
      "triangle at the bottom: stable without any damping.",
      {13, analysis::kSoft, analysis::Svg::Anchor::start, false, 0});
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::size_t row = i / kColumns, column = i % kColumns;
    LogPanel panel;
    panel.left = kLeft + static_cast<double>(column) * (kPanel + kGap);
    panel.top = kTop + static_cast<double>(row) * (kHeight + kBetween);
    panel.width = kPanel;
    panel.height = kHeight;
    panel.x_low = 10;
    panel.x_high = 1e5;
    panel.y_low = kLeastDamping;
    panel.y_high = 1e3;
    draw_boundaries(svg, panel, panels[i].second, panels[i].first, i % kColumns == 0);
  }
  return svg.document(width, height, "Stability boundaries: damping over stiffness",
                      "Each panel asks one question; logarithmic both ways. Lines: b = K (T/2 + "
                      "t_d) + |B|. Dots: the least damping with which the simulated loop comes to "
                      "rest.");
}

std::string integrator_figure(const StabilityReport& report) {
  constexpr double kPanel = 316, kHeight = 250, kLeft = 66, kGap = 62, kTop = 112;
  constexpr std::array<std::string_view, 4> kMethods = {"explicit", "semi-implicit", "implicit",
                                                        "exact"};
  std::vector<std::string> cases;
  for (const IntegratorRow& row : report.integrators) {
    if (cases.empty() || cases.back() != row.oscillator) cases.push_back(row.oscillator);
  }
  const double width = kLeft + 3 * kPanel + 2 * kGap + 24, height = kTop + kHeight + 56;
  analysis::Svg svg;
  svg.rect(0, 0, width, height, "#ffffff");
  svg.text(16, 30, "Integrators: the exact one costs least and errs least",
           {18, analysis::kInk, analysis::Svg::Anchor::start, true, 0});
  double x = 16;
  for (std::size_t i = 0; i < kMethods.size(); ++i) {
    svg.circle(x + 5, 58, 4, kColours[i]);
    svg.text(x + 14, 62, kMethods[i], {12, analysis::kInk, analysis::Svg::Anchor::start, false, 0});
    x += 14 + analysis::text_width(kMethods[i], 12) + 22;
  }
  svg.text(x, 62, "dots: 1, 4, 16, ... 1024 steps a tick; what blows up is not drawn",
           {12, analysis::kSoft, analysis::Svg::Anchor::start, false, 0});
  LogPanel panel{kLeft, kTop, kPanel, kHeight, 1, 1e5, kLeastError, 1};
  for (std::size_t c = 0; c < cases.size(); ++c) {
    panel.left = kLeft + static_cast<double>(c) * (kPanel + kGap);
    draw_panel(svg, panel, {cases[c], "ns a tick", c == 0 ? "worst error, m" : ""});
    for (std::size_t i = 0; i < kMethods.size(); ++i) {
      std::vector<std::pair<double, double>> points;
      for (const IntegratorRow& row : report.integrators) {
        if (row.oscillator == cases[c] && row.method == kMethods[i] && std::isfinite(row.error)) {
          points.emplace_back(row.ns_per_tick, std::max(row.error, kLeastError));
        }
      }
      draw_path(svg, panel, points, kColours[i], 1.4);
      for (const auto& [ns, error] : points) {
        svg.circle(panel.x(ns), panel.y(error), i == 3 ? 5 : 3.5, kColours[i]);
      }
    }
  }
  return svg.document(width, height, "Error over run time of integrators",
                      "A panel for each oscillator, logarithmic both ways.");
}

}  // namespace palpate::runner
