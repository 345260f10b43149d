// Random paths have the properties of their kinds: length of the probe, number of ticks, a start
// outside, steps.

#include "runner/evidence/verification/random_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {
namespace paths_by_kind {

constexpr double kLength = 0.12;
constexpr std::size_t kTicks = 400;

std::vector<rendering::LineProbe> path_of(PathKind kind, const stimuli::ConvexMesh& mesh, bool side,
                                          std::uint64_t seed) {
  Random random(seed);
  return random_path(random, kind, mesh, kLength, side, kTicks);
}

/// Of the tip, m.
double median_step(const std::vector<rendering::LineProbe>& path) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < path.size(); ++i)
    steps.push_back(glm::distance(path[i].tip, path[i - 1].tip));
  std::ranges::sort(steps);
  return steps[steps.size() / 2];
}

/// How far the segment is from the middle of the mesh, m.
double distance_to_middle(const rendering::LineProbe& probe) {
  const Vec3 d = probe.tail - probe.tip;
  const double at = std::clamp(-glm::dot(probe.tip, d) / glm::dot(d, d), 0.0, 1.0);
  return glm::length(probe.tip + at * d);
}

TEST(RandomPaths, KeepLengthTicksAndPlaceAndComeBackToEachSeed) {
  const std::vector<stimuli::ConvexMesh> meshes{stimuli::ConvexMesh(stimuli::cube(0.05)),
                                                stimuli::ConvexMesh(stimuli::cone(0.03, 0.06, 16)),
                                                stimuli::ConvexMesh(stimuli::icosphere(0.01, 2))};
  for (int k = 0; k < kPathKinds; ++k) {
    const auto kind = static_cast<PathKind>(k);
    for (const stimuli::ConvexMesh& mesh : meshes) {
      for (const bool side : {true, false}) {
        const auto path = path_of(kind, mesh, side, 3), same = path_of(kind, mesh, side, 3),
                   other = path_of(kind, mesh, side, 4);
        ASSERT_EQ(path.size(), kTicks) << to_string(kind);
        // At least not near the middle.
        EXPECT_GT(distance_to_middle(path[0]), 0.1 * mesh.size()) << to_string(kind);
        std::size_t alike = 0;
        for (std::size_t i = 0; i < path.size(); ++i) {
          EXPECT_NEAR(glm::distance(path[i].tip, path[i].tail), kLength, 1e-12) << to_string(kind);
          EXPECT_LT(glm::length(path[i].tip), 50 * mesh.size() + kLength) << to_string(kind);
          EXPECT_TRUE(path[i].tip == same[i].tip && path[i].tail == same[i].tail);
          alike += path[i].tip == other[i].tip;
        }
        EXPECT_LT(alike, kTicks / 2) << to_string(kind);
      }
    }
  }
}

TEST(RandomPaths, SmoothHandsTakeSmallSteps) {
  const stimuli::ConvexMesh cube(stimuli::cube(0.05));
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const double smooth = median_step(path_of(PathKind::smooth, cube, false, seed));
    EXPECT_GT(smooth, 1e-5 * cube.size());
    EXPECT_LT(smooth, 0.1 * cube.size()) << "1e-4 to 0.03, in three directions";
    EXPECT_GT(median_step(path_of(PathKind::jumps, cube, false, seed)), 0.3 * cube.size());
  }
}

TEST(RandomPaths, AlignedOnesTouchTheSurfaceExactlyWhereTheyAreMeantTo) {
  // On a cube, many poses have a coordinate of an end or of the direction exactly on a face's
  // plane.
  const stimuli::ConvexMesh cube(stimuli::cube(0.05));
  std::size_t exact = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const rendering::LineProbe& probe : path_of(PathKind::aligned, cube, false, seed)) {
      ++all;
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(std::abs(probe.tip[axis]) - 0.025) < 1e-12) {
          ++exact;
          break;
        }
      }
    }
  }
  EXPECT_GT(exact, all / 4);
}

TEST(RandomPaths, KindsHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (int k = 0; k < kPathKinds; ++k) names.insert(to_string(static_cast<PathKind>(k)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kPathKinds));
  EXPECT_FALSE(names.contains(""));
}

}  // namespace paths_by_kind
}  // namespace
}  // namespace palpate::runner::evidence
