#include "analysis/figures/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/marks.h"
#include "analysis/figures/palette.h"
#include "runner/commands/accuracy/report.h"
#include "runner/commands/stability/report.h"

namespace palpate::runner {
namespace {

constexpr double kPanelWidth = 300, kPanelHeight = 250, kRoom = 1240;  // px: three side by side
constexpr double kLeastDamping = 1e-4, kMostDamping = 1e3;             // N s/m
constexpr double kLeastError = 1e-19;                                  // m

/// The curve's name in the panel's upper left corner, `row` names below the top.
void add_name(analysis::Panel& panel, const std::string& name, analysis::Role role,
              std::size_t row) {
  const double dy = 18 + 15 * static_cast<double>(row);
  analysis::Mark dot =
      analysis::symbol(role, analysis::MarkerShape::circle, panel.x.low, panel.y.high, 3.5);
  dot.dx = 12;
  dot.dy = dy - 4;
  panel.marks.push_back(std::move(dot));
  analysis::Mark text =
      analysis::text_mark(analysis::Role::ink, panel.x.low, panel.y.high, name, 11);
  text.anchor = -1;
  text.dx = 21;
  text.dy = dy;
  panel.marks.push_back(std::move(text));
}

void add_curve(analysis::Panel& panel, const BoundaryCurve& curve, analysis::Role role) {
  analysis::Mark theory = analysis::line_mark(role, {}, {}, 1.4);
  for (const BoundaryPoint& point : curve.points) {
    const double x = std::log10(point.stiffness);
    if (point.promised) {
      theory.x.push_back(x);
      theory.y.push_back(std::log10(std::max(point.theory, kLeastDamping)));
    }
    const std::string text = curve.name + ", " + significant(point.stiffness) + " N/m: ";
    if (point.measured > 0) {
      panel.marks.push_back(
          analysis::symbol(role, analysis::MarkerShape::circle, x,
                           std::clamp(std::log10(point.measured), panel.y.low, panel.y.high), 3.5,
                           text + significant(point.measured) + " N s/m"));
    } else {
      panel.marks.push_back(analysis::symbol(role, analysis::MarkerShape::down, x, panel.y.low, 3.5,
                                             text + "stable without any damping"));
      panel.marks.back().dy = -4;
    }
  }
  if (theory.x.size() > 1) panel.marks.push_back(std::move(theory));
}

}  // namespace

analysis::Figure stability_figure(const StabilityReport& report) {
  analysis::Figure figure;
  figure.id = "stability";
  figure.title = "A stiffer wall needs more damping: lines are the theory, dots the loop";
  figure.subtitle =
      "Below a line no hand can make it buzz. A dot on or under its line is on the safe side; a "
      "triangle at the bottom: stable without any damping.";
  figure.description =
      "Stability boundaries: damping over stiffness. Each panel asks one question; logarithmic "
      "both ways. Lines: b = K (T/2 + t_d) + |B|. Dots: the least damping with which the simulated "
      "loop comes to rest.";
  figure.max_row_width = kRoom;
  std::size_t row = 0;
  for (const BoundaryCurve& curve : report.curves) {
    if (figure.panels.empty() || figure.panels.back().title != curve.panel) {
      analysis::Panel panel;
      panel.title = curve.panel;
      panel.x = analysis::decades_axis(10, 1e5, "stiffness K (N/m)");
      panel.y =
          analysis::decades_axis(kLeastDamping, kMostDamping, "damping b of each end (N s/m)");
      panel.width = kPanelWidth;
      panel.height = kPanelHeight;
      figure.panels.push_back(std::move(panel));
      row = 0;
    }
    analysis::Panel& panel = figure.panels.back();
    add_curve(panel, curve, analysis::line_role(row));
    add_name(panel, curve.name, analysis::line_role(row), row);
    ++row;
  }
  return figure;
}

analysis::Figure integrator_figure(const StabilityReport& report) {
  constexpr std::array kMethods = {"explicit", "semi-implicit", "implicit", "exact"};
  analysis::Figure figure;
  figure.id = "integrators";
  figure.title = "Integrators: the exact one costs least and errs least";
  figure.subtitle = "Dots: 1, 4, 16, ... 1024 steps a tick; what blows up is not drawn.";
  figure.description =
      "Error over run time of integrators. A panel for each oscillator, logarithmic both ways.";
  figure.max_row_width = kRoom;
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    figure.legend.push_back({kMethods[m], analysis::line_role(m), analysis::MarkerShape::circle});
  }
  for (const IntegratorRow& row : report.integrators) {
    if (!figure.panels.empty() && figure.panels.back().title == row.oscillator) continue;
    analysis::Panel panel;
    panel.title = row.oscillator;
    panel.x = analysis::decades_axis(1, 1e5, "ns a tick");
    panel.y = analysis::decades_axis(kLeastError, 1, "worst error (m)");
    panel.width = kPanelWidth;
    panel.height = kPanelHeight;
    figure.panels.push_back(std::move(panel));
  }
  for (analysis::Panel& panel : figure.panels) {
    for (std::size_t m = 0; m < kMethods.size(); ++m) {
      analysis::Mark line = analysis::line_mark(analysis::line_role(m), {}, {}, 1.4);
      for (const IntegratorRow& row : report.integrators) {
        if (row.oscillator != panel.title || row.method != kMethods[m]) continue;
        if (!std::isfinite(row.error)) continue;
        line.x.push_back(std::clamp(std::log10(row.ns_per_tick), panel.x.low, panel.x.high));
        line.y.push_back(
            std::clamp(std::log10(std::max(row.error, kLeastError)), panel.y.low, panel.y.high));
        panel.marks.push_back(analysis::symbol(
            analysis::line_role(m), analysis::MarkerShape::circle, line.x.back(), line.y.back(),
            m == 3 ? 5 : 3.5,
            row.method + ", " + std::to_string(row.steps) + " steps a tick: " +
                significant(row.ns_per_tick) + " ns, error " + significant(row.error) + " m"));
      }
      if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    }
  }
  return figure;
}

}  // namespace palpate::runner
