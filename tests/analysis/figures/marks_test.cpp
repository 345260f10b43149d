// Intervals, outlines of symbols, widths of texts and placement of labels.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {
namespace marks {

Panel panel_of(double x_low, double x_high, double y_low, double y_high) {
  Panel panel;
  panel.x.low = x_low;
  panel.x.high = x_high;
  panel.y.low = y_low;
  panel.y.high = y_high;
  panel.width = 400;
  panel.height = 200;
  return panel;
}

TEST(Interval, HasACapAtEachEnd) {
  Panel panel = panel_of(0, 4, 0, 10);
  add_interval(panel, Role::ray, 1.5, 2, 8, "2 to 8");
  ASSERT_EQ(panel.marks.size(), 3U);
  EXPECT_EQ(panel.marks[0].kind, Mark::Kind::interval);
  EXPECT_EQ(panel.marks[0].y, (std::vector<double>{2, 8}));
  std::vector<double> ends;
  for (const Mark& mark : panel.marks) {
    EXPECT_EQ(mark.x, std::vector<double>{1.5});
    EXPECT_EQ(mark.role, Role::ray);
    EXPECT_EQ(mark.text, "2 to 8");
    if (mark.kind != Mark::Kind::symbol) continue;
    EXPECT_EQ(mark.shape, MarkerShape::dash);
    EXPECT_EQ(mark.dy, 0);
    ends.push_back(mark.y[0]);
  }
  std::ranges::sort(ends);
  EXPECT_EQ(ends, (std::vector<double>{2, 8}));
}

TEST(Interval, IsCutAtTheAxisWithAnArrow) {
  Panel panel = panel_of(0, 4, 0, 10);
  add_interval(panel, Role::ink, 1, -5, 20, "");
  ASSERT_EQ(panel.marks.size(), 3U);
  EXPECT_EQ(panel.marks[0].y, (std::vector<double>{0, 10}));
  for (std::size_t i = 1; i < 3; ++i) {
    const Mark& arrow = panel.marks[i];
    const bool upper = arrow.y[0] == 10;
    EXPECT_EQ(arrow.shape, upper ? MarkerShape::up : MarkerShape::down);
    EXPECT_EQ(arrow.dy > 0, upper) << "within the panel; y is down";
  }
  panel.marks.clear();
  add_interval(panel, Role::ink, 1, 0, 10, "");
  for (std::size_t i = 1; i < 3; ++i) EXPECT_EQ(panel.marks[i].shape, MarkerShape::dash);
}

TEST(Interval, AcrossHasEqualCapsOrArrows) {
  Panel panel = panel_of(-10, 10, 0, 40);
  add_interval_across(panel, Role::ink, 20, -4, 6, "t");
  ASSERT_EQ(panel.marks.size(), 3U);
  EXPECT_EQ(panel.marks[0].x, (std::vector<double>{-4, 6}));
  EXPECT_EQ(panel.marks[0].y, (std::vector<double>{20, 20}));
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(panel.marks[i].kind, Mark::Kind::line);
    EXPECT_EQ(panel.marks[i].x, std::vector<double>(2, i == 1 ? -4 : 6));
    // 5 px up and down: 200 px are 40 units.
    EXPECT_EQ(panel.marks[i].y, (std::vector<double>{19, 21}));
    EXPECT_EQ(panel.marks[i].text, "t");
  }
  panel.marks.clear();
  add_interval_across(panel, Role::ink, 20, -40, 60, "t");
  ASSERT_EQ(panel.marks.size(), 3U);
  EXPECT_EQ(panel.marks[0].x, (std::vector<double>{-10, 10}));
  EXPECT_EQ(panel.marks[1].shape, MarkerShape::left);
  EXPECT_EQ(panel.marks[1].x[0], -10);
  EXPECT_GT(panel.marks[1].dx, 0);
  EXPECT_EQ(panel.marks[2].shape, MarkerShape::right);
  EXPECT_EQ(panel.marks[2].x[0], 10);
  EXPECT_LT(panel.marks[2].dx, 0);
}

TEST(Outline, FitsTheSymbolAndLooksLikeItsName) {
  const auto right = outline_of(MarkerShape::right), left = outline_of(MarkerShape::left);
  ASSERT_EQ(right.size(), 3U);
  ASSERT_EQ(left.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(left[i].first, -right[i].first);
    EXPECT_EQ(left[i].second, right[i].second);
  }
  EXPECT_EQ(*std::ranges::max_element(right), std::pair(1.0, 0.0)) << "the tip";
  const auto cross = outline_of(MarkerShape::cross), saltire = outline_of(MarkerShape::saltire);
  ASSERT_EQ(cross.size(), 12U);
  ASSERT_EQ(saltire.size(), 12U);
  for (std::size_t i = 0; i < 12; ++i) {
    const auto [x, y] = cross[i];
    EXPECT_TRUE(std::fabs(x) <= 1 && std::fabs(y) <= 1);
    // The cross turned by 45 degrees.
    EXPECT_NEAR(saltire[i].first, (x - y) / std::sqrt(2.0), 1e-12);
    EXPECT_NEAR(saltire[i].second, (x + y) / std::sqrt(2.0), 1e-12);
    const auto turned = std::pair(-y, x);  // by a right angle: the cross again
    EXPECT_TRUE(std::ranges::find(cross, turned) != cross.end());
  }
  for (const MarkerShape shape : {MarkerShape::circle, MarkerShape::square, MarkerShape::diamond,
                                  MarkerShape::up, MarkerShape::down, MarkerShape::dash}) {
    EXPECT_TRUE(outline_of(shape).empty());
  }
}

TEST(TextWidth, IsTheSumOfItsCharacters) {
  EXPECT_EQ(text_width("", 12), 0);
  EXPECT_NEAR(text_width("0", 1000), 636, 1e-9) << "a digit of DejaVu Sans";
  EXPECT_NEAR(text_width("mi~ ", 1000), 974 + 278 + 838 + 318, 1e-9);
  EXPECT_NEAR(text_width("abc", 24), 2 * text_width("abc", 12), 1e-9);
  EXPECT_NEAR(text_width("a", 12) + text_width("b", 12), text_width("ab", 12), 1e-9);
  EXPECT_NEAR(text_width("ab", 12, true), 1.13 * text_width("ab", 12), 1e-9);
  EXPECT_NEAR(text_width("é", 1000), 700, 1e-9) << "one character of two bytes";
  EXPECT_NEAR(text_width("形", 1000), 1050, 1e-9) << "full width";
}

TEST(Fitting, KeepsAsManyCharactersAsFit) {
  const std::string text = "less time with the ray (%)";
  EXPECT_EQ(fitting(text, text_width(text, 12) + 0.01, 12), text);
  for (double available = 20; available < text_width(text, 12); available += 7) {
    const std::string cut = fitting(text, available, 12);
    EXPECT_LE(text_width(cut, 12), available);
    ASSERT_TRUE(cut.ends_with("…"));
    const std::size_t kept = width(cut) - 1;
    EXPECT_EQ(cut.substr(0, kept), text.substr(0, kept));
    EXPECT_GT(text_width(text.substr(0, kept + 1) + "…", 12), available) << "one more fits not";
  }
}

TEST(LinesOf, BreakAtSpacesAndFit) {
  const std::string text = "Percent of the trials of a row; bold: the right answer (95 % of them).";
  const auto lines = lines_of(text, 150, 12);
  ASSERT_GT(lines.size(), 2U);
  std::string whole;
  for (const std::string& line : lines) {
    EXPECT_LE(text_width(line, 12), 150);
    whole += (whole.empty() ? "" : " ") + line;
    EXPECT_FALSE(line.starts_with("%"));
  }
  EXPECT_EQ(whole, text);
  EXPECT_EQ(lines_of("wwwwwwwwwwwwwwwwwwwwwwww a", 30, 12),
            (std::vector<std::string>{"wwwwwwwwwwwwwwwwwwwwwwww", "a"}));
  EXPECT_GE(lines_of(text, 150, 12, true).size(), lines.size()) << "bold is wider";
}

struct Box {
  double left, right, top, bottom;
  bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

/// px; of a text mark in a panel of its full width.
Box box_of(const Panel& panel, const Mark& text) {
  const double x = (text.x[0] - panel.x.low) / (panel.x.high - panel.x.low) * panel.width + text.dx;
  const double y =
      (panel.y.high - text.y[0]) / (panel.y.high - panel.y.low) * panel.height + text.dy;
  const double wide = text_width(text.text, text.size, text.bold);
  const double left = text.anchor < 0 ? x : x - wide;
  return {left, left + wide, y - text.size, y};
}

Mark label_at(double x, double y, const std::string& name) {
  Mark label = text_mark(Role::ink, x, y, name, 13);
  label.kind = Mark::Kind::label;
  return label;
}

TEST(Labels, StandRightOfTheirPointUnlessBlocked) {
  Panel panel = panel_of(0, 10, 0, 10);
  panel.marks.push_back(label_at(5, 5, "cone"));
  const auto texts = placed_labels(panel, panel.width);
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_EQ(texts[0].kind, Mark::Kind::text);
  EXPECT_EQ(texts[0].text, "cone");
  EXPECT_EQ(texts[0].anchor, -1);
  EXPECT_GT(texts[0].dx, 7) << "px: beside the symbol";
  EXPECT_LT(texts[0].dx, 20);
  EXPECT_LT(std::fabs(texts[0].dy), 8) << "at the height of the point";
}

TEST(Labels, GoToTheLeftAtTheRightEnd) {
  Panel panel = panel_of(0, 10, 0, 10);
  panel.marks.push_back(label_at(9.9, 5, "cylinder"));
  const auto texts = placed_labels(panel, panel.width);
  EXPECT_EQ(texts[0].anchor, 1);
  EXPECT_LT(texts[0].dx, -7);
  panel.marks[0] = label_at(0.1, 5, "cylinder");
  EXPECT_EQ(placed_labels(panel, panel.width)[0].anchor, -1);
}

TEST(Labels, StayInThePanelEvenWhenBlocked) {
  // At the right end, with a point where the label goes: beside that, not out of the panel.
  Panel panel = panel_of(0, 10, 0, 10);
  panel.marks.push_back(label_at(9.9, 5, "cylinder"));
  for (const double at : {9.3, 8.9, 8.6}) {
    panel.marks.push_back(label_at(at, 5, ""));
  }
  const auto texts = placed_labels(panel, panel.width);
  const Mark& text = texts.front();
  const double left = 400 * text.x[0] / 10 + text.dx -
                      (text.anchor > 0 ? text_width(text.text, text.size, text.bold) : 0);
  EXPECT_LE(left + text_width(text.text, text.size, text.bold), 412);
}

TEST(Labels, AvoidEachOtherThePointsAndIntervals) {
  Panel panel = panel_of(0, 10, 0, 10);
  const std::vector<std::pair<double, double>> points{
      {4.0, 5.0}, {4.3, 5.2}, {4.6, 4.9}, {4.1, 4.6}, {5.1, 5.1}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    panel.marks.push_back(
        label_at(points[i].first, points[i].second, "shape " + std::to_string(i)));
  }
  add_interval(panel, Role::ink, 5.6, 3, 7, "");
  const auto texts = placed_labels(panel, panel.width);
  ASSERT_EQ(texts.size(), points.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const Box own = box_of(panel, texts[i]);
    EXPECT_EQ(texts[i].text, "shape " + std::to_string(i));
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(own.meets(box_of(panel, texts[j])));
    for (const auto& [x, y] : points) {
      const double px = x * 40, py = (10 - y) * 20;
      EXPECT_FALSE(own.meets({px - 5, px + 5, py - 5, py + 5})) << i;
    }
    EXPECT_FALSE(own.meets({5.6 * 40 - 1, 5.6 * 40 + 1, 60, 140})) << i << " on the interval";
  }
}

}  // namespace marks
}  // namespace
}  // namespace palpate::analysis
