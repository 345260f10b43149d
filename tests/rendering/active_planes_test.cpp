// The nearest point that half-spaces allow (rendering/active_planes.h).

#include "rendering/active_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

namespace palpate::rendering {
namespace {

/// Holds the point within rounding, and the shares add up to it.
void expect_held(const std::vector<PlaneBound>& planes, double narrow) {
  const ConstrainedPoint nearest = constrained_point(planes, 1e-16);
  ASSERT_TRUE(nearest.found) << narrow;
  Vec3 sum(0);
  double most = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    EXPECT_GT(nearest.multipliers[i], 0) << narrow;
    EXPECT_NEAR(glm::dot(planes[i].normal, nearest.point), planes[i].bound, 1e-16) << narrow;
    sum += nearest.multipliers[i] * planes[i].normal;
    most = std::max(most, nearest.multipliers[i]);
  }
  EXPECT_LE(glm::length(sum - nearest.point), 1e-15 * most + 1e-16) << narrow;
}

// Nearly antiparallel planes hold the point between them, some 2 cm away, with shares of up to
// kilometres that almost cancel.
TEST(ActivePlanes, HoldThePointExactlyInNarrowWedges) {
  for (int k = 0; k < 400; ++k) {
    const double narrow = std::pow(10, -1 - 0.0125 * k);  // rad
    const Vec3 x = glm::normalize(Vec3(1, 0.3 + 0.01 * k, -0.2));
    const Vec3 y = glm::normalize(glm::cross(x, Vec3(0.1, 0.2, 1)));
    const Vec3 p = glm::normalize(y + narrow * x), q = glm::normalize(-y + 0.3 * narrow * x);
    const Vec3 held = 0.02 * x + 0.007 * y;
    const std::vector<PlaneBound> wedge{{p, glm::dot(p, held)}, {q, glm::dot(q, held)}};
    expect_held(wedge, narrow);
    const Vec3 z = glm::cross(x, y), r = glm::normalize(z + 0.1 * x);
    const Vec3 corner = held + 0.01 * z;
    expect_held({{p, glm::dot(p, corner)}, {q, glm::dot(q, corner)}, {r, glm::dot(r, corner)}},
                narrow);
  }
}

}  // namespace
}  // namespace palpate::rendering
