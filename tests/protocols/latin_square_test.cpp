#include <gtest/gtest.h>

#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "protocols/order.h"

namespace palpate::protocols {
namespace {

TEST(LatinSquare, IsBalancedForPositionAndNeighbours) {
  for (int n = 1; n <= 12; ++n) {
    std::map<std::pair<int, int>, int> at_position, neighbours;
    const int rows = latin_square_rows(n);
    for (int participant = 1; participant <= rows; ++participant) {
      const std::vector<int> row = latin_square_row(n, participant);
      EXPECT_EQ(std::set<int>(row.begin(), row.end()).size(), static_cast<std::size_t>(n));
      ASSERT_EQ(row.size(), static_cast<std::size_t>(n));
      for (int k = 0; k < n; ++k) {
        const auto i = static_cast<std::size_t>(k);
        ++at_position[{k, row[i]}];
        if (k > 0) ++neighbours[{row[i - 1], row[i]}];
      }
    }
    ASSERT_EQ(at_position.size(), static_cast<std::size_t>(n * n));
    for (const auto& [cell, times] : at_position) EXPECT_EQ(times, rows / n) << "n = " << n;
    ASSERT_EQ(neighbours.size(), static_cast<std::size_t>(n * (n - 1)));
    for (const auto& [pair, times] : neighbours) EXPECT_EQ(times, rows / n) << "n = " << n;
  }
}

TEST(LatinSquare, RepeatsAfterItsRows) {
  EXPECT_EQ(latin_square_row(2, 1), (std::vector<int>{0, 1}));
  EXPECT_EQ(latin_square_row(2, 2), (std::vector<int>{1, 0}));
  EXPECT_EQ(latin_square_row(2, 3), (std::vector<int>{0, 1}));
  EXPECT_EQ(latin_square_row(3, 7), latin_square_row(3, 1));
}

TEST(LatinSquare, RefusesASizeOrRowBelowItsRange) {
  EXPECT_THROW(latin_square_row(0, 1), std::invalid_argument);
  EXPECT_THROW(latin_square_row(2, 0), std::invalid_argument);
}

}  // namespace
}  // namespace palpate::protocols
