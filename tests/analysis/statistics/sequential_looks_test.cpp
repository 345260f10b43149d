#include "analysis/statistics/sequential_looks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace palpate::analysis {
namespace {

// Two-sided 0.05: the tables of Jennison & Turnbull 2000 and of the package gsDesign for R (sfLDOF,
// sfLDPocock, 0.025 on either side).
TEST(SequentialLooks, BoundsEqualTables) {
  struct Table {
    Spending spending;
    std::vector<std::size_t> participants;
    std::vector<double> bounds;
  };
  const Table tables[] = {
      {Spending::obrien_fleming, {10, 20, 30, 40, 50}, {4.877, 3.357, 2.680, 2.290, 2.031}},
      {Spending::obrien_fleming, {12, 24}, {2.963, 1.969}},
      {Spending::obrien_fleming, {1, 2, 3}, {3.710, 2.511, 1.993}},
      {Spending::pocock, {10, 20, 30, 40, 50}, {2.438, 2.427, 2.410, 2.397, 2.386}}};
  for (const Table& table : tables) {
    const auto looks = planned_looks(table.spending, 0.05, table.participants);
    ASSERT_EQ(looks.size(), table.bounds.size());
    for (std::size_t k = 0; k < looks.size(); ++k)
      EXPECT_NEAR(looks[k].bound, table.bounds[k], 6e-4);
  }
}

TEST(SequentialLooks, OneLookIsThePlainTest) {
  for (const Spending spending : {Spending::obrien_fleming, Spending::pocock}) {
    const auto looks = planned_looks(spending, 0.01, {24});
    ASSERT_EQ(looks.size(), 1);
    EXPECT_NEAR(looks[0].alpha, 0.01, 1e-12);
    EXPECT_NEAR(looks[0].bound, 2.5758293035489, 1e-9);
  }
}

TEST(SequentialLooks, AllLooksTogetherErrAtAlpha) {
  const std::vector<std::size_t> at = {7, 8, 20, 40};
  for (const Spending spending : {Spending::obrien_fleming, Spending::pocock}) {
    const auto looks = planned_looks(spending, 0.05, at);
    for (const std::uint64_t seed : {1, 2, 3}) {
      std::mt19937_64 random(seed);
      std::normal_distribution<double> normal;
      constexpr int kStudies = 100'000;
      std::vector<int> stopped(at.size());
      for (int study = 0; study < kStudies; ++study) {
        double sum = 0;
        std::size_t n = 0;
        for (std::size_t k = 0; k < at.size(); ++k) {
          for (; n < at[k]; ++n) sum += normal(random);
          if (std::abs(sum) / std::sqrt(static_cast<double>(n)) < looks[k].bound) continue;
          for (std::size_t later = k; later < at.size(); ++later) ++stopped[later];
          break;
        }
      }
      for (std::size_t k = 0; k < at.size(); ++k) {
        const double share = static_cast<double>(stopped[k]) / kStudies;
        EXPECT_NEAR(share, looks[k].spent, 4 * std::sqrt(looks[k].spent / kStudies)) << at[k];
      }
    }
  }
}

TEST(SequentialLooks, LooksSideBySideStayFinite) {
  const auto looks = planned_looks(Spending::obrien_fleming, 0.05, {2, 3, 5'000, 5'001, 10'000});
  double spent = 0;
  for (const Look& look : looks) {
    EXPECT_TRUE(std::isfinite(look.bound));
    EXPECT_GE(look.alpha, 0);
    EXPECT_GE(look.spent, spent);
    spent = look.spent;
  }
  EXPECT_NEAR(spent, 0.05, 1e-15);
}

}  // namespace
}  // namespace palpate::analysis
