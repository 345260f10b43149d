#include "analysis/statistics/sweep_analysis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "analysis/report/report.h"
#include "data/base/random.h"
#include "tests/analysis/sweep_table_fixture.h"

namespace palpate::analysis {
namespace {

using namespace palpate::analysis::testing;

Outcome nothing(const std::vector<double>&) { return {}; }

// The samples of a base point share coordinates: with 29 parameters 31 of them say little more than
// two. The truth is one half, by symmetry.
TEST(PatternShare, SaltelliIntervalHoldsTheTruthAtItsRate) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  constexpr int kSweeps = 400;
  for (const std::size_t parameters : {3U, 29U}) {
    int held = 0;
    for (int s = 0; s < kSweeps; ++s) {
      const SweepTable table = table_of(
          "saltelli", saltelli_points(parameters, 64, [&] { return random.unit(); }), nothing);
      const PatternShare share = pattern_share(table, "x1 + x2 + x3 < 1.5");
      held += share.ci95->low <= 0.5 && 0.5 <= share.ci95->high;
    }
    EXPECT_NEAR(held, 0.95 * kSweeps, 16) << parameters;  // 3.7 standard errors
  }
}

TEST(PatternShare, CountsSaltellisSamplesAAndB) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  SweepTable table =
      table_of("saltelli", saltelli_points(4, 10, [&] { return random.unit(); }), nothing);
  table.failed[7] = true;  // the B of the second base point
  table.failed[3] = true;  // neither A nor B
  std::size_t holds = 0;
  for (std::size_t row = 0; row < 60; ++row)
    holds += row % 6 < 2 && row != 7 && table.values[1][row] < 0.4;
  const PatternShare share = pattern_share(table, "x2 < 0.4");
  EXPECT_EQ(share.n, 19u);
  EXPECT_EQ(share.undefined, 1u);
  EXPECT_EQ(share.holds, holds);
  EXPECT_EQ(share.at.size(), 60u);  // the indices are of all samples
  EXPECT_EQ(std::count_if(share.at.begin(), share.at.end(), [](double x) { return std::isnan(x); }),
            2);
}

// One of seven levels lies below 0.09, but 9 % of the distribution: no interval is about that.
TEST(PatternShare, AGridHasNoInterval) {
  const SweepAnalysis analysis =
      analyze_sweep(table_of("grid", grid_points(4, 7), nothing), "x1 < 0.09", "1");
  EXPECT_EQ(analysis.pattern->holds, 343u);
  EXPECT_EQ(analysis.pattern->n, 2401u);
  EXPECT_NEAR(*analysis.pattern->share, 1.0 / 7, 1e-12);
  EXPECT_FALSE(analysis.pattern->ci95);
  EXPECT_TRUE(
      std::any_of(analysis.notes.begin(), analysis.notes.end(), [](const std::string& note) {
        return note.find("not a sample of the distributions") != std::string::npos;
      }));
  EXPECT_EQ(sweep_answer(analysis), "The pattern holds in 14.3 % of the grid's points");
  for (const std::string& said :
       {sweep_text(analysis), sweep_json(analysis), sweep_html(analysis)}) {
    EXPECT_NE(said.find("not a sample of the distributions"), std::string::npos);
    EXPECT_EQ(said.find("Wilson's interval"), std::string::npos);
  }
}

TEST(SweepAnalysis, SeeksPapersPatternGivenItsShapesAndRenderers) {
  // Two settings: one as in the paper, one where the sphere gains as much.
  SweepTable table = table_of("lhs", {{0.2}, {0.8}}, [](const auto&) { return Outcome{22, 1}; });
  EXPECT_FALSE(analyze_sweep(table, "", "1").pattern) << "the cone alone";
  for (const auto& [shape, gains] : std::vector<std::pair<std::string, std::vector<double>>>{
           {"cube", {11, 11}}, {"sphere", {0, 22}}, {"cylinder", {0, 0}}}) {
    table.shapes.push_back(shape);
    table.columns.insert(table.columns.end(), {"gain_" + shape, "gain_se_" + shape});
    table.values.insert(table.values.end(), {gains, {1, 1}});
  }
  const SweepAnalysis papers = analyze_sweep(table, "", "1");
  ASSERT_TRUE(papers.pattern);
  EXPECT_TRUE(papers.pattern->of_the_paper);
  EXPECT_NEAR(*papers.pattern->share, 0.5, 1e-12);
  table.renderers = {"point", "other"};
  EXPECT_FALSE(analyze_sweep(table, "", "1").pattern) << "other renderers";
}

TEST(SweepAnalysis, SaysWhichTotalIndicesContainChance) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  const auto points = saltelli_points(2, 200, [&] { return random.unit(); });
  const auto noisy = [&](const std::vector<double>& x) {
    return Outcome{10 * x[0] + 3 * random.normal(), 3};
  };
  const SweepAnalysis known = analyze_sweep(table_of("saltelli", points, noisy), "cone > 5", "1");
  EXPECT_TRUE(known.drivers[0].sobol->noise_share);
  EXPECT_EQ(chance_note(known.drivers[0]), "");
  EXPECT_NE(chance_note(known.drivers[1]), "");  // a pattern has no standard error
  const SweepAnalysis unknown =
      analyze_sweep(table_of("saltelli", points,
                             [&](const std::vector<double>& x) {
                               return Outcome{10 * x[0] + 3 * random.normal(), std::nan("")};
                             }),
                    "", "1");
  EXPECT_FALSE(unknown.drivers[0].sobol->noise_share);
  EXPECT_NE(sweep_text(unknown).find("Every total index includes chance within the points"),
            std::string::npos);
  EXPECT_NE(sweep_json(unknown).find("Every total index includes chance within the points"),
            std::string::npos);
}

}  // namespace
}  // namespace palpate::analysis
