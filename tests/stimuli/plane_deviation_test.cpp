#include "stimuli/plane_deviation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::stimuli {
namespace {

// Two triangles over the side from (0,0,0) to (1,0,0): one in the xy plane on the left with its tip
// at `tip`, the other on the right, bent down by `angle` (radians).
double deviation_of(double angle, const Vec3& tip, double width, double error) {
  const Vec3 side(1, 0, 0);
  PolygonExtent left(side), right(-side);
  left.include(tip);
  right.include(Vec3(-0.5, -width * std::cos(angle), -width * std::sin(angle)));
  return plane_deviation(Vec3(0, 0, 1), Vec3(0, -std::sin(angle), std::cos(angle)), side, left,
                         right, error);
}

TEST(PlaneDeviation, IsTheDistanceThatWouldFlattenIt) {
  const Vec3 tip(0.5, 1, 0);
  EXPECT_NEAR(deviation_of(1e-6, tip, 1, 1e-9), 500, 1e-3);
  EXPECT_NEAR(deviation_of(1e-6, tip, 1e-3, 1e-9), 1, 2e-3);
  EXPECT_NEAR(deviation_of(-1e-6, tip, 1, 1e-9), -500, 1e-3) << "a concave edge is negative";
  EXPECT_EQ(deviation_of(0, tip, 1, 1e-9), 0);
}

TEST(PlaneDeviation, AllowsForCornersFarPastTheSidesEnds) {
  EXPECT_NEAR(deviation_of(1e-6, Vec3(10, 1, 0), 1, 1e-9), 50, 1e-3);
  EXPECT_NEAR(deviation_of(1e-6, Vec3(-9, 1, 0), 1, 1e-9), 50, 1e-3);
}

TEST(PlaneDeviation, SharpEdgesAreNeverCoplanar) {
  const Vec3 tip(0.5, 1, 0);
  EXPECT_NEAR(deviation_of(3.14159, tip, 1, 1e-9), 5e8, 1);
  EXPECT_NEAR(deviation_of(-3.14159, tip, 1, 1e-9), -5e8, 1);
  EXPECT_GT(deviation_of(1.6, tip, 1, 10), kCoplanar);
  EXPECT_LT(deviation_of(-1.6, tip, 1, 10), -kCoplanar);
}

}  // namespace
}  // namespace palpate::stimuli
