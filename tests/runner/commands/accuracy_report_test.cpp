#include "runner/evidence/reports/accuracy_report.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "analysis/figures/svg.h"

namespace palpate::runner::commands {
namespace {

evidence::AccuracyRow row_of(const std::string& shape, int triangles, const std::string& probe) {
  evidence::AccuracyRow row;
  row.shape = shape;
  row.triangles = triangles;
  row.probe = probe;
  row.method = "tick";
  row.ns_per_tick = 50;
  return row;
}

// A new shape is measured automatically; it must appear in all outputs too.
TEST(AccuracyReport, ShowsEveryShapeThatWasMeasured) {
  evidence::AccuracyReport report;
  for (const char* probe : {"ray", "point"}) {
    report.rows.push_back(row_of("sphere", 20, probe));
    report.rows.push_back(row_of("sphere", 80, probe));
    for (const char* added : {"octahedron", "wedge", "prism", "pyramid"}) {
      report.rows.push_back(row_of(added, 8, probe));
    }
  }
  const std::string text = evidence::accuracy_text(report),
                    figure = analysis::figure_svg(evidence::accuracy_figure(report),
                                                  analysis::light_palette());
  const auto json = evidence::accuracy_json(report);
  ASSERT_EQ(json["recommended"].size(), 5U);
  EXPECT_EQ(json["recommended"][0]["shape"], "sphere");
  EXPECT_EQ(json["recommended"][1]["shape"], "octahedron");
  EXPECT_NE(text.find("  octahedron: its 8 triangles are the shape itself"), std::string::npos)
      << text;
  EXPECT_NE(text.find("Whole ticks on the pyramid"), std::string::npos);
  for (const char* shape : {"sphere", "octahedron", "wedge", "prism", "pyramid"}) {
    EXPECT_NE(figure.find(std::string(">") + shape + "<"), std::string::npos) << shape;
  }
  // Two kinds of error with the same axes, each in rows of three panels.
  const std::vector<analysis::Panel> panels = evidence::accuracy_figure(report).panels;
  ASSERT_EQ(panels.size(), 10U);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    EXPECT_EQ(panels[p].starts_row, p % 5 == 0 || p % 5 == 3);
    EXPECT_EQ(panels[p].y.title.empty(), !panels[p].starts_row);
    EXPECT_EQ(panels[p].x.high, panels[0].x.high);
    EXPECT_EQ(panels[p].y.low, panels[p < 5 ? 0 : 5].y.low);
  }
}

TEST(AccuracyReport, FitsThePageAndTellsMethodsWithoutColour) {
  evidence::AccuracyReport report;
  const std::vector<std::string> methods{"tick", "walk",        "walk-float", "walk-cold",
                                         "scan", "brute-force", "bullet",     "fcl"};
  for (const char* shape : {"sphere", "cone", "cylinder", "cube", "box"}) {
    for (const std::string& method : methods) {
      report.rows.push_back(row_of(shape, 20, "ray"));
      report.rows.back().method = method;
    }
  }
  const analysis::Figure figure = evidence::accuracy_figure(report);
  ASSERT_EQ(figure.legend.size(), methods.size());
  std::set<analysis::MarkerShape> shapes;
  for (const analysis::LegendEntry& entry : figure.legend) shapes.insert(entry.shape);
  EXPECT_EQ(shapes.size(), methods.size());
  for (const analysis::LegendEntry& entry : figure.legend) {
    const bool drawn = std::ranges::any_of(figure.panels[0].marks, [&](const analysis::Mark& mark) {
      return mark.text.starts_with(entry.label + ",") && mark.shape == entry.shape;
    });
    EXPECT_TRUE(drawn) << entry.label;
  }
  // A page is some 920 px wide: a drawing of 1040 px has letters of 9 px there.
  const std::string svg = analysis::figure_svg(figure, analysis::light_palette());
  EXPECT_LE(std::stod(svg.substr(svg.find(" width=\"") + 8)), 1040);
}

}  // namespace
}  // namespace palpate::runner::commands
