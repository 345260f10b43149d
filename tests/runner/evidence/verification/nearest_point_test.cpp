// The oracle's solvers, by the properties that characterise their results.

#include "runner/evidence/verification/nearest_point.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"

namespace palpate::runner::evidence {
namespace {

// The nearest point of a convex set lies in it, and the displacement to it is a sum of non-negative
// multiples of the normals of planes that it lies on.
TEST(NearestPoint, SatisfiesTheKuhnTuckerConditions) {
  int found = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed);
    std::vector<HalfSpace> planes;
    const std::size_t count = random.below(7);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 normal = stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
      planes.push_back({normal, 2 * random.unit() - 1.5});
    }
    const Vec3 from{random.normal(), random.normal(), random.normal()};
    const auto nearest = nearest_point(from, planes, 1e-14);
    if (!nearest) continue;
    ++found;
    Vec3 sum = from;
    for (std::size_t i = 0; i < count; ++i) {
      const double height = glm::dot(planes[i].normal, nearest->point) - planes[i].offset;
      EXPECT_GE(height, -1e-14);
      EXPECT_GE(nearest->multipliers[i], 0);
      if (nearest->multipliers[i] > 0) {
        EXPECT_LE(height, 1e-12);
      }
      sum += nearest->multipliers[i] * planes[i].normal;
    }
    EXPECT_LE(glm::length(sum - nearest->point), 1e-12) << seed;
  }
  EXPECT_GT(found, 1500);
}

TEST(NearestPoint, WithoutCommonPointsIsEmpty) {
  const std::array<HalfSpace, 2> apart{HalfSpace{{0, 0, 1}, 1}, HalfSpace{{0, 0, -1}, 1}};
  EXPECT_FALSE(nearest_point(Vec3(0), apart, 1e-14).has_value());
}

// A vector is as far from a cone as it is from its nearest point there.
TEST(DistanceToCone, EqualsNearestPoint) {
  const std::array<Vec3, 3> corner{Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  EXPECT_EQ(distance_to_cone({1, 2, 3}, corner), 0);
  EXPECT_EQ(distance_to_cone({1, 2, -3}, corner), 3);
  EXPECT_EQ(distance_to_cone({-3, 2, -4}, corner), 5);
  EXPECT_EQ(distance_to_cone({-3, 0, -4}, {}), 5);
  // Moreau: the residual is the nearest point of the polar cone.
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed, {4});
    std::vector<Vec3> normals;
    std::vector<HalfSpace> polar;
    for (std::size_t count = random.below(6); normals.size() < count;) {
      normals.push_back(stimuli::uniform_rotation(random) * Vec3(0, 0, 1));
      polar.push_back({-normals.back(), 0});
    }
    const Vec3 vector{random.normal(), random.normal(), random.normal()};
    const auto left = nearest_point(vector, polar, 1e-14);
    ASSERT_TRUE(left) << seed;
    EXPECT_NEAR(distance_to_cone(vector, normals), glm::length(left->point), 1e-12) << seed;
  }
}

TEST(DistanceToCone, IsExactBetweenNearlyAntiparallelNormals) {
  for (const double opening : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const std::array<Vec3, 2> wedge{glm::normalize(Vec3(opening, 0, 1)),
                                    glm::normalize(Vec3(opening, 0, -1))};
    EXPECT_LE(distance_to_cone({1, 0, 0.3}, wedge), 1e-11) << opening;
    EXPECT_NEAR(distance_to_cone({1, 0.2, 0.3}, wedge), 0.2, 1e-11) << opening;
    EXPECT_NEAR(distance_to_cone({-1, 0, 0}, wedge), 1, opening) << opening;
  }
}

}  // namespace
}  // namespace palpate::runner::evidence
