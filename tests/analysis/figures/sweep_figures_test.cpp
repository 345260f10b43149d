#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>

#include "analysis/figures/figures.h"
#include "analysis/statistics/sweep_analysis.h"
#include "data/base/random.h"
#include "tests/analysis/figures/figure_form.h"
#include "tests/analysis/sweep_table_fixture.h"

namespace palpate::analysis {
namespace {

using namespace palpate::analysis::testing;

constexpr std::size_t kMostDots = 400;

std::vector<Mark> dots_of(const SweepTable& table, const std::string& id) {
  for (const Figure& figure : sweep_figures(analyze_sweep(table, "", "1"))) {
    if (figure.id != id) continue;
    std::vector<Mark> dots;
    for (const Mark& mark : figure.panels.at(0).marks) {
      if (mark.kind == Mark::Kind::symbol && mark.role == Role::ray) dots.push_back(mark);
    }
    return dots;
  }
  ADD_FAILURE() << "no figure " << id;
  return {};
}

Outcome mostly_first(const std::vector<double>& x) {
  double gain = 20 * x[0];
  for (std::size_t p = 1; p < x.size(); ++p) gain += x[p];
  return {gain, 0.1};
}

TEST(SweepFigures, ShowAsManyPointsAsTheySay) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (const std::size_t n : {1U, 399U, 400U, 401U, 799U, 800U, 2500U}) {
    std::vector<std::vector<double>> points;
    for (std::size_t i = 0; i < n; ++i) points.push_back({random.unit(), random.unit()});
    const SweepTable table = table_of("lhs", points, mostly_first);
    EXPECT_EQ(dots_of(table, "gains").size(), std::min(n, kMostDots)) << n;
    if (n < 4) continue;  // no correlation
    EXPECT_EQ(dots_of(table, "scatter").size(), std::min(n, kMostDots)) << n;
  }
}

// Points that are chosen at a fixed step are those of one level, or the A samples alone.
TEST(SweepFigures, ChosenPointsAreOfTheWholeDesign) {
  const SweepTable grid = table_of("grid", grid_points(4, 7), mostly_first);
  std::set<double> levels;
  for (const Mark& dot : dots_of(grid, "scatter")) levels.insert(dot.x.at(0));
  EXPECT_EQ(levels.size(), 7u);

  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  const SweepTable saltelli =
      table_of("saltelli", saltelli_points(3, 400, [&] { return random.unit(); }), mostly_first);
  std::vector<int> samples(5);
  for (const Mark& dot : dots_of(saltelli, "scatter"))
    ++samples[static_cast<std::size_t>(std::stoi(dot.text.substr(6)) - 1) % 5];
  for (const int n : samples) EXPECT_NEAR(n, 80, 32);  // 4 standard deviations
}

TEST(SweepFigures, HaveTheirForm) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  const auto draw = [&] { return random.unit(); };
  for (const SweepTable& table :
       {table_of("grid", grid_points(2, 7), mostly_first),
        table_of("saltelli", saltelli_points(3, 200, draw), mostly_first)}) {
    const std::vector<Figure> figures = sweep_figures(analyze_sweep(table, "", "1"));
    EXPECT_GE(figures.size(), 2U);
    for (const Figure& figure : figures) {
      expect_form(figure);
      EXPECT_EQ(figure.label, "SIMULATED PARTICIPANTS");
      // Of how many points, of which design, and how large each is.
      const std::string points = std::to_string(table.rows()) + " points (" + table.design + "), ";
      EXPECT_EQ(figure.subtitle, points + "1 participant and 1 repetition each");
    }
  }
}

TEST(SweepFigures, AreTheSameEachTime) {
  const SweepTable grid = table_of("grid", grid_points(4, 7), mostly_first);
  const std::vector<Mark> one = dots_of(grid, "scatter"), two = dots_of(grid, "scatter");
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].text, two[i].text);
}

}  // namespace
}  // namespace palpate::analysis
