// The figure of single times: density, median, quartiles, limits and time-outs.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {
namespace time_distribution {

struct Cell {
  std::string renderer;
  std::vector<double> times;   ///< s, of correct answers
  std::vector<double> limits;  ///< s, of time-outs
};

/// The figure of one participant's times with a cone.
Figure figure_of(const std::vector<Cell>& cells) {
  TrialTableBuilder builder;
  int trial = 0;
  const auto add = [&](const std::string& renderer, double time, bool timed_out) {
    StudyTrial raw;
    raw.participant = "A";
    raw.renderer = renderer;
    raw.shape = "cone";
    raw.response = timed_out ? "" : "cone";
    raw.correct = !timed_out;
    raw.timed_out = timed_out;
    raw.trial = ++trial;
    raw.response_time = time;
    builder.add(raw);
  };
  for (const Cell& cell : cells) {
    for (const double time : cell.times) add(cell.renderer, time, false);
    for (const double limit : cell.limits) add(cell.renderer, limit, true);
  }
  const auto figures = figures_of(analyze(builder.finish({}), {}, "test"), {});
  const auto found = std::ranges::find(figures, "times", &Figure::id);
  return found == figures.end() ? Figure() : *found;
}

std::vector<Mark> marks_of(const Figure& figure, Mark::Kind kind) {
  std::vector<Mark> out;
  for (const Mark& mark : figure.panels.at(0).marks) {
    if (mark.kind == kind) out.push_back(mark);
  }
  return out;
}

/// 41 times about 10 s and further ones from 2 to 50 s; the middle half is about 10 s.
std::vector<double> peaked_times() {
  std::vector<double> times;
  for (int i = -20; i <= 20; ++i) times.push_back(10 * std::pow(10, 0.002 * i));
  for (int i = 0; i < 8; ++i) times.push_back(2 + 0.5 * i);
  for (int i = 0; i < 8; ++i) times.push_back(20 + 4 * i);
  return times;
}

/// Quantile of the log10 times, interpolated between the two nearest (R's type 7).
double log_quantile(std::vector<double> times, double p) {
  std::ranges::sort(times);
  const double at = p * static_cast<double>(times.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const double next = std::log10(times[std::min(below + 1, times.size() - 1)]);
  return std::lerp(std::log10(times[below]), next, at - std::floor(at));
}

TEST(TimesFigure, HalfViolinsAreWidestWhereMostTimesAre) {
  const std::vector<double> times = peaked_times();
  const Figure figure = figure_of({{"point", times, {}}, {"ray", times, {}}});
  const auto areas = marks_of(figure, Mark::Kind::area);
  ASSERT_EQ(areas.size(), 2U);
  for (std::size_t r = 0; r < 2; ++r) {
    const Mark& area = areas[r];
    EXPECT_EQ(area.role, r == 0 ? Role::point : Role::ray);
    std::size_t widest = 0;
    for (std::size_t i = 0; i < area.x.size(); ++i) {
      EXPECT_EQ(area.x[i] > 0.5, r == 1) << "point on the left, ray on the right";
      EXPECT_LT(std::fabs(area.x[i] - 0.5), 0.5) << "within the slot";
      if (std::fabs(area.x[i] - 0.5) > std::fabs(area.x[widest] - 0.5)) widest = i;
    }
    EXPECT_NEAR(area.y[widest], 1, 0.03) << "log10 of 10 s";
    const auto [low, high] = std::ranges::minmax(area.y);
    EXPECT_GT(low, std::log10(2) - 0.15);
    EXPECT_LT(low, std::log10(2) + 0.1);
    EXPECT_GT(high, std::log10(48) - 0.1);
    EXPECT_LT(high, std::log10(48) + 0.15);
  }
  EXPECT_EQ(areas[0].y, areas[1].y) << "the same times";
  for (std::size_t i = 0; i < areas[0].x.size(); ++i) {
    EXPECT_NEAR(0.5 - areas[0].x[i], areas[1].x[i] - 0.5, 1e-12) << "mirrored";
  }
}

TEST(TimesFigure, MarksTheMedianAndTheMiddleHalf) {
  const std::vector<double> times = peaked_times();
  const Figure figure = figure_of({{"point", times, {}}, {"ray", {3, 4, 5}, {}}});
  const auto lines = marks_of(figure, Mark::Kind::line);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NEAR(lines[0].y[0], log_quantile(times, 0.25), 1e-6);
  EXPECT_NEAR(lines[0].y[1], log_quantile(times, 0.75), 1e-6);
  EXPECT_EQ(lines[0].x[0], lines[0].x[1]);
  std::vector<double> few;
  for (const Mark& mark : marks_of(figure, Mark::Kind::symbol)) {
    if (mark.x[0] < 0.5) {
      EXPECT_NEAR(mark.y[0], log_quantile(times, 0.5), 1e-6);
    } else {
      few.push_back(std::pow(10, mark.y[0]));
    }
  }
  ASSERT_EQ(few.size(), 3U) << "single times where there are few";
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(few[i], 3 + static_cast<double>(i), 1e-5);
  const std::string point = "cone, point: median 10.0 s, middle 50 % " +
                            fixed(std::pow(10, log_quantile(times, 0.25)), 2) + " to " +
                            fixed(std::pow(10, log_quantile(times, 0.75)), 2) + " s, 57 times";
  EXPECT_NE(figure.description.find(point), std::string::npos) << figure.description;
  // Quartiles of the logs: geometric means of the neighbours.
  EXPECT_NE(
      figure.description.find("cone, ray: median 4.00 s, middle 50 % 3.46 to 4.47 s, 3 times"),
      std::string::npos)
      << figure.description;
}

TEST(TimesFigure, ADensityNeedsTwelveTimes) {
  const std::vector<double> twelve{3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
  EXPECT_EQ(marks_of(figure_of({{"ray", twelve, {}}}), Mark::Kind::area).size(), 1U);
  EXPECT_EQ(marks_of(figure_of({{"ray", {twelve.begin() + 1, twelve.end()}, {}}}), Mark::Kind::area)
                .size(),
            0U);
  EXPECT_TRUE(figure_of({{"ray", {}, {30}}}).panels.empty()) << "no times, no figure";
}

TEST(TimesFigure, MoreRenderersHaveWholeViolinsSideBySide) {
  const std::vector<double> times = peaked_times();
  const Figure figure = figure_of({{"a", times, {}}, {"b", times, {}}, {"c", times, {}}});
  const auto areas = marks_of(figure, Mark::Kind::area);
  ASSERT_EQ(areas.size(), 3U);
  double before = 0;
  for (const Mark& area : areas) {
    const auto [left, right] = std::ranges::minmax(area.x);
    EXPECT_GT(left, before);
    EXPECT_LT(right, 1);
    before = right;
    // Symmetric: corners come in pairs about the middle.
    const double middle = (left + right) / 2;
    for (std::size_t i = 0; i < area.x.size(); ++i) {
      const std::size_t other = area.x.size() - 1 - i;
      EXPECT_NEAR(area.x[i] - middle, middle - area.x[other], 1e-12);
      EXPECT_NEAR(area.y[i], area.y[other], 1e-12);
    }
  }
}

TEST(TimesFigure, LimitsHaveLineTickAndTimeOuts) {
  const std::vector<double> times = peaked_times();
  const Figure figure = figure_of({{"point", times, {60, 60, 60}}, {"ray", times, {60}}});
  const Panel& panel = figure.panels[0];
  std::vector<Mark> lines;
  for (const Mark& mark : marks_of(figure, Mark::Kind::line)) {
    if (mark.role == Role::amber) lines.push_back(mark);
  }
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].x, (std::vector<double>{panel.x.low, panel.x.high}));
  EXPECT_NEAR(lines[0].y[0], std::log10(60), 1e-12);
  EXPECT_EQ(lines[0].text, "limit of 60 s");
  EXPECT_EQ(std::ranges::count(panel.y.ticks, "limit 60 s", &Tick::label), 1);
  for (const Tick& tick : panel.y.ticks) {
    EXPECT_TRUE(tick.label == "limit 60 s" || std::fabs(tick.at - std::log10(60)) > 0.07);
  }
  EXPECT_GT(panel.y.high, std::log10(60)) << "room for the numbers of time-outs";
  // 3 of 60 and 1 of 58 trials.
  std::vector<std::string> texts;
  for (const Mark& mark : marks_of(figure, Mark::Kind::text)) texts.push_back(mark.text);
  EXPECT_EQ(texts, (std::vector<std::string>{"3 (5.0 %)", "1 (1.7 %)"}));
  EXPECT_NE(figure.description.find("cone, point: 3 time-outs of 60 trials. "), std::string::npos);
  EXPECT_NE(figure.description.find("cone, ray: 1 time-out of 58 trials. "), std::string::npos);
  for (const Mark& area : marks_of(figure, Mark::Kind::area)) {
    EXPECT_LE(*std::ranges::max_element(area.y), std::log10(60)) << "no times beyond the limit";
  }
}

TEST(TimesFigure, DrawsTheFirstAndLastOfManyLimits) {
  const auto drawn = [](const std::vector<double>& limits) {
    std::vector<double> seconds;
    for (const Mark& mark : marks_of(figure_of({{"point", {3, 4, 5}, limits}}), Mark::Kind::line)) {
      if (mark.role == Role::amber) seconds.push_back(std::round(std::pow(10, mark.y[0])));
    }
    return seconds;
  };
  EXPECT_EQ(drawn({20, 40, 30}), (std::vector<double>{20, 30, 40}));
  EXPECT_EQ(drawn({20, 40, 30, 60}), (std::vector<double>{20, 60}));
  EXPECT_EQ(drawn({}), std::vector<double>{});
}

/// Densities sum to 1 whatever the number of times: of few and of many, the half violins cover as
/// much. All times are alike, so that both have the least bandwidth.
TEST(TimesFigure, FewTimesCoverAsMuchAsMany) {
  const std::vector<double> few(12, 8.0), many(240, 8.0);
  const auto areas = marks_of(figure_of({{"point", few, {}}, {"ray", many, {}}}), Mark::Kind::area);
  ASSERT_EQ(areas.size(), 2U);
  double covered[2] = {0, 0};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto [least, most] = std::ranges::minmax(areas[i].x);
    const double edge = i == 0 ? most : least;  // the straight side, towards the other half
    for (const double x : areas[i].x) covered[i] += std::abs(x - edge);
  }
  EXPECT_NEAR(covered[0] / covered[1], 1, 1e-6);
}

}  // namespace time_distribution
}  // namespace
}  // namespace palpate::analysis
