// Wilson's interval of independent settings, for settings that a design spreads more evenly.

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/statistics/sweep_analysis.h"
#include "runner/sweep/design.h"
#include "tests/analysis/sweep_table_fixture.h"

namespace palpate::runner::sweep {
namespace {

// Owen (1997, Ann. Stat. 25, 1541-1562): of n points of a Latin hypercube a mean's variance is at
// most n / (n - 1) of that of independent ones. A Sobol sequence's digital shift has no such bound.
TEST(PatternShare, IntervalCoversTheTruthAtLeastAtItsNominalRate) {
  const struct {
    const char* pattern;
    double truth;
  } cases[] = {{"x1 < 0.3", 0.3},
               {"x1 + x2 + x3 < 1.5", 0.5},
               {"x1 * x2 > 0.5", 0.5 + 0.5 * std::log(0.5)},
               // No effect of a single parameter: as bad as independent points.
               {"(x1 < 0.5 && x2 < 0.5) || (x1 >= 0.5 && x2 >= 0.5)", 0.5},
               {"min(x1, x2, x3) > 0.7", 0.027}};
  constexpr std::uint64_t kSweeps = 300;
  const std::vector<protocols::SweepParameter> parameters(3);
  for (const DesignKind kind : {DesignKind::lhs, DesignKind::sobol, DesignKind::saltelli}) {
    std::vector<int> held(std::size(cases));
    for (std::uint64_t seed = 1; seed <= kSweeps; ++seed) {
      const Design design(kind, kind == DesignKind::saltelli ? 250 : 100, seed, parameters);
      std::vector<std::vector<double>> points;
      for (std::int64_t i = 1; i <= design.size(); ++i) points.push_back(design.at(i));
      const analysis::SweepTable table = analysis::testing::table_of(
          to_string(kind), points, [](const auto&) { return analysis::testing::Outcome{}; });
      for (std::size_t c = 0; c < std::size(cases); ++c) {
        const auto ci95 = analysis::pattern_share(table, cases[c].pattern).ci95;
        held[c] += ci95->low <= cases[c].truth && cases[c].truth <= ci95->high;
      }
    }
    for (std::size_t c = 0; c < std::size(cases); ++c)
      EXPECT_GE(held[c], 0.91 * kSweeps) << to_string(kind) << " " << cases[c].pattern;
  }
}

}  // namespace
}  // namespace palpate::runner::sweep
