#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "analysis/figures/svg.h"
#include "runner/commands/accuracy/report.h"

namespace palpate::runner::commands {
namespace {

rendering::AccuracyRow row_of(const std::string& shape, int triangles, const std::string& probe) {
  rendering::AccuracyRow row;
  row.shape = shape;
  row.triangles = triangles;
  row.probe = probe;
  row.method = "tick";
  row.ns_per_tick = 50;
  return row;
}

// A new shape is measured automatically; it must appear in all outputs too.
TEST(AccuracyReport, ShowsEveryShapeThatWasMeasured) {
  AccuracyReport report;
  for (const char* probe : {"ray", "point"}) {
    report.rows.push_back(row_of("sphere", 20, probe));
    report.rows.push_back(row_of("sphere", 80, probe));
    for (const char* added : {"octahedron", "wedge", "prism", "pyramid"}) {
      report.rows.push_back(row_of(added, 8, probe));
    }
  }
  const std::string text = accuracy_text(report),
                    figure =
                        analysis::figure_svg(accuracy_figure(report), analysis::light_palette());
  const auto json = accuracy_json(report);
  ASSERT_EQ(json["recommended"].size(), 5U);
  EXPECT_EQ(json["recommended"][0]["shape"], "sphere");
  EXPECT_EQ(json["recommended"][1]["shape"], "octahedron");
  EXPECT_NE(text.find("  octahedron: its 8 triangles are the shape itself"), std::string::npos)
      << text;
  EXPECT_NE(text.find("Whole ticks on the pyramid"), std::string::npos);
  for (const char* shape : {"sphere", "octahedron", "wedge", "prism", "pyramid"}) {
    EXPECT_NE(figure.find(std::string(">") + shape + "<"), std::string::npos) << shape;
  }
  // Two rows of five panels with the same axes.
  const std::vector<analysis::Panel> panels = accuracy_figure(report).panels;
  ASSERT_EQ(panels.size(), 10U);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    EXPECT_EQ(panels[p].starts_row, p % 5 == 0);
    EXPECT_EQ(panels[p].x.high, panels[0].x.high);
    EXPECT_EQ(panels[p].y.low, panels[p < 5 ? 0 : 5].y.low);
  }
}

}  // namespace
}  // namespace palpate::runner::commands
