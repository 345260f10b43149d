#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::evidence {
namespace {

// m: an error of 0 has no logarithm, and smaller errors need not be distinguished.
constexpr double kLeastOfShape = 1e-10, kLeastOfPolyhedron = 1e-18;

struct MethodLook {
  std::string_view method;
  analysis::Role role;
  analysis::MarkerShape shape;
};
// The program's own tick is dark, wide and on top.
constexpr std::array kLooks = {
    MethodLook{"tick", analysis::Role::ink, analysis::MarkerShape::circle},
    MethodLook{"walk", analysis::Role::point, analysis::MarkerShape::square},
    MethodLook{"walk-float", analysis::Role::eighth, analysis::MarkerShape::up},
    MethodLook{"walk-cold", analysis::Role::soft, analysis::MarkerShape::down},
    MethodLook{"scan", analysis::Role::fourth, analysis::MarkerShape::cross},
    MethodLook{"brute-force", analysis::Role::seventh, analysis::MarkerShape::saltire},
    MethodLook{"bullet", analysis::Role::ray, analysis::MarkerShape::right},
    MethodLook{"fcl", analysis::Role::third, analysis::MarkerShape::left}};

double of_shape(const evidence::AccuracyRow& row) {
  return std::max(kLeastOfShape, row.shape_errors.depth.rms);
}
double of_polyhedron(const evidence::AccuracyRow& row) {
  return std::max(kLeastOfPolyhedron, row.polyhedron_errors.depth.worst);
}
constexpr std::size_t kPanelsOfRow = 3;  // as many as a page has room for

using ErrorOf = double (*)(const evidence::AccuracyRow&);

/// Lines from the coarsest tessellation to the finest, one for each method.
void add_methods(analysis::Panel& panel, const AccuracyReport& report, std::string_view shape,
                 ErrorOf error) {
  for (auto look = kLooks.rbegin(); look != kLooks.rend(); ++look) {
    const bool ours = look->method == "tick";
    analysis::Mark line = analysis::line_mark(look->role, {}, {}, ours ? 2.5 : 1.2);
    for (const evidence::AccuracyRow& row : report.rows) {
      if (row.probe != "ray" || row.shape != shape || row.method != look->method) continue;
      line.x.push_back(std::log10(row.ns_per_tick));
      line.y.push_back(std::log10(error(row)));
      panel.marks.push_back(
          analysis::symbol(look->role, look->shape, line.x.back(), line.y.back(), ours ? 4.5 : 3.5,
                           row.method + ", " + thousands(row.triangles) +
                               " triangles: " + significant(row.ns_per_tick) +
                               " ns a tick, error " + significant(error(row)) + " m"));
    }
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
  }
}

/// A dashed line across the panel. \param name above it at the right; empty: none
void add_level(analysis::Panel& panel, double metres, const std::string& name) {
  const double level = std::log10(metres);
  analysis::Mark line =
      analysis::line_mark(analysis::Role::soft, {panel.x.low, panel.x.high}, {level, level}, 1);
  line.dashed = true;
  panel.marks.push_back(std::move(line));
  if (name.empty()) return;
  analysis::Mark text = analysis::text_mark(analysis::Role::soft, panel.x.high, level, name, 11);
  text.anchor = 1;
  text.dx = -4;
  text.dy = -5;
  panel.marks.push_back(std::move(text));
}

/// Panels of one kind of error, with the same axes.
void add_row(analysis::Figure& figure, const AccuracyReport& report, ErrorOf error,
             double least_high, const std::string& title) {
  double fastest = 1e9, slowest = 1, low = 1e9, high = least_high;
  for (const evidence::AccuracyRow& row : report.rows) {
    if (row.probe != "ray") continue;
    fastest = std::min(fastest, row.ns_per_tick);
    slowest = std::max(slowest, row.ns_per_tick);
    low = std::min(low, error(row));
    high = std::max(high, error(row));
  }
  const std::vector<std::string> shapes = measured_shapes(report);
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    analysis::Panel panel;
    panel.title = shapes[s];
    panel.x = analysis::decades_axis(fastest, slowest, "ns a tick");
    panel.y = analysis::decades_axis(low, high, s % kPanelsOfRow == 0 ? title : "");
    panel.width = panel.height = 215;
    panel.starts_row = s % kPanelsOfRow == 0;
    add_methods(panel, report, shapes[s], error);
    figure.panels.push_back(std::move(panel));
  }
}

}  // namespace

analysis::Figure accuracy_figure(const AccuracyReport& report) {
  analysis::Figure figure;
  figure.id = "accuracy";
  figure.title = "Tessellation decides the error, the method decides the time";
  figure.subtitle =
      "Each line runs from the coarsest to the finest tessellation; a stylus felt as a ray, a hand "
      "at 0.1 m/s, 1 to 2 mm deep.";
  figure.description =
      "Error over time for each method of finding contact. One panel for each shape, both axes "
      "logarithmic. Top: error of depth against the analytic shape. Bottom: against the exact "
      "polyhedron.";
  for (const MethodLook& look : kLooks) {
    if (std::ranges::find(report.rows, look.method, &evidence::AccuracyRow::method) !=
        report.rows.end()) {
      figure.legend.push_back({std::string(look.method), look.role, look.shape});
    }
  }
  add_row(figure, report, of_shape, kHand.position, "rms error against the shape (m)");
  // Name levels where no line is in the way: a flat-sided shape has one tessellation.
  const auto flat = std::ranges::find_if(
      figure.panels, [](const analysis::Panel& panel) { return is_flat_sided(panel.title); });
  for (auto panel = figure.panels.begin(); panel != figure.panels.end(); ++panel) {
    add_level(*panel, kHand.position, panel == flat ? "a hand feels 1 mm" : "");
    add_level(*panel, kDevice.position, panel == flat ? "a device resolves 0.03 mm" : "");
  }
  add_row(figure, report, of_polyhedron, kLeastOfPolyhedron, "worst error against polyhedron (m)");
  return figure;
}

}  // namespace palpate::runner::evidence
