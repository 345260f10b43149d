#include "analysis/figures/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/text.h"
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

/// "20 kPa", "1 MPa"
std::string in_pascals(double modulus) {
  return modulus < 1e6 ? significant(modulus / 1e3) + " kPa" : significant(modulus / 1e6) + " MPa";
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

analysis::Figure soft_map_figure(const std::vector<SoftSwing>& map) {
  constexpr double kCellWidth = 64, kCellHeight = 19;  // px
  analysis::Figure figure;
  figure.id = "soft-stability";
  int allowed = 0, settled = 0;
  for (const SoftSwing& one : map) {
    allowed += one.accepted;
    settled += one.accepted && one.settles();
  }
  figure.title =
      "A tool held still on a soft body: where scenes may have it, the force comes to rest";
  figure.subtitle =
      "Swing of the force in % of it, highest less lowest of the last 0.2 s. Amber: "
      "refused. Blue: " +
      std::to_string(settled) + " of " + std::to_string(allowed) +
      " that scenes may have within 1 %.";
  figure.description =
      "Stability of soft bodies. A panel for each tool and material; rows are moduli and contact "
      "springs, columns the rate of the body's steps, numbers the swing of the force in percent.";
  figure.max_row_width = kRoom;
  std::vector<std::string> rates, rows;
  for (const SoftSwing& one : map) {
    const SoftCase& what = one.what;
    const std::string title = "tool of " + significant(1000 * what.radius) + " mm, Poisson " +
                              significant(what.poisson) + ", damping " +
                              significant(1000 * what.damping) + " ms";
    const auto slot = [](std::vector<std::string>& names, const std::string& name) {
      const auto at = std::find(names.begin(), names.end(), name) - names.begin();
      if (at == std::ssize(names)) names.push_back(name);
      return static_cast<double>(at);
    };
    if (figure.panels.empty() || figure.panels.back().title != title) {
      figure.panels.emplace_back();
      figure.panels.back().title = title;
    }
    const std::string rate = analysis::fixed(what.rate, what.rate < 100 ? 1 : 0);
    const double x = slot(rates, rate),
                 y = slot(rows, in_pascals(what.young) + ", " + significant(what.stiffness / 1000) +
                                    " kN/m");
    analysis::Panel& panel = figure.panels.back();
    const std::string swing = one.finite ? significant(100 * one.swing) : "no number";
    // Rows are turned about once their number is known.
    panel.marks.push_back(analysis::rect_mark(
        one.accepted ? analysis::Role::point : analysis::Role::amber, x + 0.03, -y - 0.05, x + 0.97,
        -y - 0.95, one.settles() ? (one.accepted ? 0.16 : 0.25) : 0.8,
        title + ", " + rows[static_cast<std::size_t>(y)] + ", " + rate + " Hz: " + swing + " %" +
            (one.accepted ? "" : ", refused")));
    // Less than a hundredth of a percent is nothing that a number need say.
    analysis::Mark text =
        analysis::text_mark(one.settles() ? analysis::Role::ink : analysis::Role::page, x + 0.5,
                            -y - 0.5, one.finite && one.swing < 1e-4 ? "0" : swing, 11);
    text.dy = 4;
    panel.marks.push_back(std::move(text));
  }
  for (analysis::Panel& panel : figure.panels) {
    panel.x = analysis::names_axis(rates, rates.size(), "rate of the body's steps (Hz)");
    panel.y = analysis::names_axis(rows, rows.size(), "");
    for (analysis::Tick& tick : panel.y.ticks) tick.at = panel.y.high - tick.at;
    for (analysis::Mark& mark : panel.marks) {
      for (double& y : mark.y) y += panel.y.high;
    }
    panel.width = kCellWidth * static_cast<double>(rates.size());
    panel.height = kCellHeight * static_cast<double>(rows.size());
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
