#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "runner/participants/shape_hypotheses.h"
#include "stimuli/orientation.h"
#include "stimuli/primitives.h"
#include "tests/runner/participants/solids.h"

namespace palpate::runner::participants {
namespace {

std::vector<Quat> symmetries_of(const std::vector<PlacedPart>& parts) {
  return symmetries(parts, DistanceField(parts));
}

// The orders of rotation groups, from geometry.
TEST(RotationGrid, FindsTheSymmetriesOfASolid) {
  namespace solids = stimuli::solids;
  EXPECT_EQ(symmetries_of(test::placed(stimuli::cube(0.06))).size(), 24U);
  EXPECT_EQ(symmetries_of(test::placed(stimuli::box(Vec3(0.06, 0.06, 0.03)))).size(), 8U);
  EXPECT_EQ(symmetries_of(test::placed(stimuli::box(Vec3(0.06, 0.04, 0.03)))).size(), 4U);
  EXPECT_EQ(symmetries_of(test::placed(solids::torus(0.035, 0.014, 8, 8).soup)).size(), 16U);
  const auto ell = solids::l_shape().soup;
  EXPECT_EQ(symmetries_of(test::placed(ell, Vec3(-0.02, -0.02, -0.015))).size(), 2U);
  EXPECT_EQ(symmetries_of(test::placed(ell, Vec3(-0.01, -0.02, -0.015))).size(), 1U)
      << "its axis does not run through the centre";
  const auto plus = solids::moved(solids::plus_shape(), Quat(1, 0, 0, 0), 0.01, Vec3(0, 0, -0.01));
  EXPECT_EQ(symmetries_of(test::placed(plus.soup)).size(), 8U);
  const auto tower = test::placed(stimuli::cone(0.03, 0.06, 4));
  EXPECT_EQ(symmetries_of(tower).size(), 4U) << "a pyramid";
}

double angle_between(const Quat& a, const Quat& b) {
  return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a, b)))) * 180 / std::numbers::pi;
}

TEST(RotationGrid, EveryOrientationIsNearOneUpToSymmetry) {
  for (const Vec3& size :
       {Vec3(0.06, 0.06, 0.06), Vec3(0.06, 0.06, 0.03), Vec3(0.06, 0.04, 0.03)}) {
    const std::vector<Quat> group = symmetries_of(test::placed(stimuli::box(size)));
    const std::vector<Mat3> grid = distinct_rotations(group);
    EXPECT_NEAR(static_cast<double>(grid.size()), 9120.0 / static_cast<double>(group.size()),
                0.05 * 9120 / static_cast<double>(group.size()) + 10);
    std::vector<Quat> turns;
    for (const Mat3& r : grid) turns.push_back(glm::quat_cast(r));
    constexpr std::uint64_t kSeed = 1;
    Random random(kSeed);
    for (int i = 0; i < 100; ++i) {
      const Quat wanted = stimuli::uniform_rotation(random);
      double nearest = 180;
      for (const Quat& turn : turns) {
        for (const Quat& same : group)
          nearest = std::min(nearest, angle_between(wanted, turn * same));
      }
      EXPECT_LT(nearest, 13);
    }
  }
  const std::vector<Mat3> all = distinct_rotations({Quat(1, 0, 0, 0)});
  EXPECT_GT(all.size(), 4000U);
  EXPECT_LT(all.size(), 5000U);
}

}  // namespace
}  // namespace palpate::runner::participants
