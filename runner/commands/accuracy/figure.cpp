#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/svg.h"
#include "runner/commands/accuracy/report.h"
#include "runner/commands/shared/log_panel.h"

namespace palpate::runner {
namespace {

// m; a logarithm must have something for an error of 0, and nobody needs to tell such errors apart.
constexpr double kLeastOfShape = 1e-10, kLeastOfPolyhedron = 1e-18;

struct Colour {
  std::string_view method, colour;
};
// Okabe & Ito's colours, to be told apart by everyone; the product is dark.
constexpr std::array kColours = {Colour{"tick", analysis::kInk},  Colour{"walk", "#0072B2"},
                                 Colour{"walk-float", "#56B4E9"}, Colour{"walk-cold", "#8C8C8C"},
                                 Colour{"scan", "#009E73"},       Colour{"brute-force", "#E69F00"},
                                 Colour{"bullet", "#D55E00"},     Colour{"fcl", "#CC79A7"}};

double of_shape(const rendering::AccuracyRow& row) {
  return std::max(kLeastOfShape, row.shape_errors.depth.rms);
}
double of_polyhedron(const rendering::AccuracyRow& row) {
  return std::max(kLeastOfPolyhedron, row.polyhedron_errors.depth.worst);
}

/// One shape's panel: a line for each method from its coarsest tessellation to its finest.
void draw_methods(analysis::Svg& svg, const LogPanel& panel, const AccuracyReport& report,
                  std::string_view shape, double (*error)(const rendering::AccuracyRow&)) {
  for (auto c = kColours.rbegin(); c != kColours.rend(); ++c) {  // the product is on top
    std::vector<std::pair<double, double>> points;
    for (const rendering::AccuracyRow& row : report.rows) {
      if (row.probe == "ray" && row.shape == shape && row.method == c->method) {
        points.emplace_back(row.ns_per_tick, error(row));
      }
    }
    const bool ours = c->method == "tick";
    draw_path(svg, panel, points, c->colour, ours ? 2.5 : 1.2);
    for (const auto& [ns, e] : points) {
      svg.circle(panel.x(ns), panel.y(e), ours ? 3.5 : 2.5, c->colour);
    }
  }
}

void draw_legend(analysis::Svg& svg, const AccuracyReport& report, double x, double y) {
  for (const Colour& colour : kColours) {
    const bool there =
        std::any_of(report.rows.begin(), report.rows.end(),
                    [&](const rendering::AccuracyRow& r) { return r.method == colour.method; });
    if (!there) continue;
    svg.line(x, y - 4, x + 18, y - 4, colour.colour, colour.method == "tick" ? 2.5 : 1.5);
    svg.circle(x + 9, y - 4, 3, colour.colour);
    svg.text(x + 24, y, colour.method,
             {12, analysis::kInk, analysis::Svg::Anchor::start, false, 0});
    x += 24 + analysis::text_width(colour.method, 12) + 22;
  }
}

}  // namespace

std::string accuracy_figure(const AccuracyReport& report) {
  constexpr double kPanel = 230, kHeight = 230, kLeft = 62, kGap = 58, kTop = 112, kRight = 20;
  constexpr double kBetween = 84;
  const std::vector<std::string> shapes = measured_shapes(report);
  // The legend needs the width of four panels.
  const auto columns = static_cast<double>(std::max<std::size_t>(shapes.size(), 4));
  const double width = kLeft + columns * (kPanel + kGap) - kGap + kRight;
  analysis::Svg svg;
  svg.rect(0, 0, width, kTop + 2 * kHeight + kBetween + 52, "#ffffff");
  svg.text(16, 30, "Tessellation decides the error, the method decides the time",
           {18, analysis::kInk, analysis::Svg::Anchor::start, true, 0});
  svg.text(16, 52,
           "Each line runs from the coarsest to the finest tessellation; a stylus felt as a ray, "
           "a hand at 0.1 m/s, 1 to 2 mm deep.",
           {13, analysis::kSoft, analysis::Svg::Anchor::start, false, 0});
  draw_legend(svg, report, 16, 78);
  LogPanel shape_errors{0, kTop, kPanel, kHeight, 1e9, 1, 1e9, kLeastOfShape};
  LogPanel exact_errors{0,   kTop + kHeight + kBetween, kPanel, kHeight, 1e9, 1,
                        1e9, kLeastOfPolyhedron};
  for (const rendering::AccuracyRow& row : report.rows) {
    if (row.probe != "ray") continue;
    for (auto [panel, error] :
         {std::pair{&shape_errors, of_shape(row)}, std::pair{&exact_errors, of_polyhedron(row)}}) {
      panel->x_low = std::min(panel->x_low, row.ns_per_tick);
      panel->x_high = std::max(panel->x_high, row.ns_per_tick);
      panel->y_low = std::min(panel->y_low, error);
      panel->y_high = std::max(panel->y_high, error);
    }
  }
  shape_errors.y_high = std::max(shape_errors.y_high, kHand.position);
  shape_errors.round_ends();
  exact_errors.round_ends();
  // Levels are named where no line is in the way: a shape of flats has one tessellation.
  const auto flat = std::find_if(shapes.begin(), shapes.end(), is_flat_sided);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const double left = kLeft + static_cast<double>(i) * (kPanel + kGap);
    shape_errors.left = exact_errors.left = left;
    const std::string& name = shapes[i];
    draw_panel(svg, shape_errors,
               {name, "ns a tick", i == 0 ? "rms depth error against the shape, m" : ""});
    const bool named = flat != shapes.end() && name == *flat;
    draw_level(svg, shape_errors, kHand.position, named ? "a hand feels 1 mm" : "");
    draw_level(svg, shape_errors, kDevice.position, named ? "a device resolves 0.03 mm" : "");
    draw_methods(svg, shape_errors, report, name, of_shape);
    draw_panel(svg, exact_errors,
               {name, "ns a tick", i == 0 ? "worst against the polyhedron, m" : ""});
    draw_methods(svg, exact_errors, report, name, of_polyhedron);
  }
  return svg.document(width, kTop + 2 * kHeight + kBetween + 52,
                      "Error over time for each method of finding contact",
                      "One panel for each shape, both axes logarithmic. Top: error of depth "
                      "against the analytic shape. Bottom: against the exact polyhedron.");
}

}  // namespace palpate::runner
