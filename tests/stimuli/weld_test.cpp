// Welded points, against a check of every pair.

#include "stimuli/weld.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "tests/shared/rounds.h"

namespace palpate::stimuli {
namespace {
namespace welding {

using Numbers = std::vector<std::uint32_t>;

/// Clusters of points linked by pairs within the tolerance, each named by its first point.
Numbers by_all_pairs(const std::vector<Vec3>& points, double tolerance) {
  Numbers of(points.size());
  for (std::uint32_t i = 0; i < of.size(); ++i) of[i] = i;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (of[i] == of[j] || glm::distance(points[i], points[j]) > tolerance) continue;
      const std::uint32_t low = std::min(of[i], of[j]), high = std::max(of[i], of[j]);
      std::replace(of.begin(), of.end(), high, low);
    }
  }
  return of;
}

TEST(Weld, TakesTheFirstOfEachCluster) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  int welded = 0;
  for (int round = 0; round < testing::rounds(200); ++round) {
    std::vector<Vec3> points;
    const std::size_t count = 1 + random.below(60);
    for (std::size_t i = 0; i < count; ++i)
      points.emplace_back(random.unit(), random.unit(), random.unit());
    for (std::size_t i = 0; i < count / 3; ++i) points.push_back(points[random.below(count)]);
    const double tolerance = round % 5 == 0 ? 0 : 0.15 * random.unit();
    const Numbers expected = by_all_pairs(points, tolerance);
    EXPECT_EQ(weld(points, tolerance), expected) << round;
    for (std::uint32_t i = 0; i < expected.size(); ++i) welded += expected[i] != i;
  }
  EXPECT_GT(welded, 1000);
}

TEST(Weld, APairAtTheToleranceIsOne) {
  for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
    const std::vector<Vec3> points{Vec3(0), 0.25 * along};
    EXPECT_EQ(weld(points, 0.25), (Numbers{0, 0}));
    EXPECT_EQ(weld(points, 0.2499), (Numbers{0, 1}));
  }
}

/// A chain of neighbours is one cluster, listed from either end.
TEST(Weld, ChainsAreOne) {
  std::vector<Vec3> chain;
  for (int i = 0; i < 10; ++i) chain.emplace_back(0.1 * i, 0, 0);
  EXPECT_EQ(weld(chain, 0.11), Numbers(10, 0));
  std::reverse(chain.begin(), chain.end());
  EXPECT_EQ(weld(chain, 0.11), Numbers(10, 0));
}

TEST(Weld, ZeroHasNoSign) {
  EXPECT_EQ(weld({Vec3(0.0, -0.0, 1), Vec3(-0.0, 0.0, 1), Vec3(0, 0, -1)}, 0), (Numbers{0, 0, 2}));
  EXPECT_EQ(weld({}, 0), Numbers{});
}

}  // namespace welding
}  // namespace
}  // namespace palpate::stimuli
