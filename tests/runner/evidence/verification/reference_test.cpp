#include "runner/evidence/verification/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "stimuli/signed_distance.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_mesh.h"

namespace palpate::runner::evidence {
namespace {

using testing::moved;

void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance) << "(" << a.x << " " << a.y << " " << a.z << ") is not ("
                                           << b.x << " " << b.y << " " << b.z << ")";
}

stimuli::ConvexMesh cube_of_two() { return stimuli::ConvexMesh(stimuli::cube(2)); }

TEST(ReferenceDepth, PointInACubeIsAsDeepAsItsNearestFace) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const Vec3 p(0.3, -0.9, 0.5);
  const ReferenceDepth found = reference_depth(mesh, {p, p});
  EXPECT_NEAR(found.depth, 0.1, 1e-15);
  expect_near(found.normal, Vec3(0, -1, 0), 1e-15);
}

TEST(ReferenceDepth, EndOfAStickCountsFromTheDeeperEnd) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const rendering::LineProbe standing{{0.2, 0.1, 0.75}, {0.3, 0.2, 5}};
  const rendering::LineProbe hanging{standing.tail, standing.tip};
  EXPECT_NEAR(reference_depth(mesh, standing).depth, 0.25, 1e-15);
  EXPECT_NEAR(reference_depth(mesh, hanging).depth, 0.25, 1e-15);
  expect_near(reference_depth(mesh, standing).normal, Vec3(0, 0, 1), 1e-15);
}

TEST(ReferenceDepth, EdgesPushSticksOutAtRightAngles) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const Vec3 out = glm::normalize(Vec3(1, 0, 1));
  const Vec3 middle = Vec3(1, 0.3, 1) - 0.1 * out;
  const Vec3 along(3, 0, -3);
  const ReferenceDepth found = reference_depth(mesh, {middle - along, middle + along});
  EXPECT_NEAR(found.depth, 0.1, 1e-15);
  expect_near(found.normal, out, 1e-15);
}

TEST(ReferenceDepth, StickThroughTheWholeCubeLeavesSideways) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const ReferenceDepth found = reference_depth(mesh, {{-7, 0.4, 0.1}, {7, 0.4, 0.1}});
  EXPECT_NEAR(found.depth, 0.6, 1e-15);
  expect_near(found.normal, Vec3(0, 1, 0), 1e-15);
}

TEST(ReferenceDepth, NegativeWithoutTouch) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  EXPECT_LT(reference_depth(mesh, {{0, 0, 1.01}, {0, 0, 2}}).depth, 0);
  // Past an edge: no facet of the cube separates the stick from it.
  EXPECT_LT(reference_depth(mesh, {{2.5, 0, -0.4}, {-0.4, 0, 2.5}}).depth, 0);
}

TEST(ReferenceGap, ToFaceEdgeAndCornerOfACube) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  EXPECT_NEAR(reference_gap(mesh, {{0.2, 0.3, 1.5}, {0.2, 0.4, 9}}), 0.5, 1e-15);
  EXPECT_NEAR(reference_gap(mesh, {{2, 0.3, 2}, {5, 0.3, 9}}), std::sqrt(2), 1e-15);
  EXPECT_NEAR(reference_gap(mesh, {{2, 2, 2}, {2, 2, 2}}), std::sqrt(3), 1e-15);
  EXPECT_NEAR(reference_gap(mesh, {{4, 0, 0}, {0, 0, 4}}), std::sqrt(2), 1e-15);  // across an edge
  EXPECT_NEAR(reference_gap(mesh, {{-9, 0.5, 3}, {9, 0.5, 3}}), 2, 1e-15);        // along a face
}

TEST(ReferenceGap, ZeroOnTouchAndOverlap) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  EXPECT_EQ(reference_gap(mesh, {{0, 0, 1}, {0, 0, 3}}), 0);
  EXPECT_EQ(reference_gap(mesh, {{0, 0, 0}, {0, 0, 0.1}}), 0);
  EXPECT_EQ(reference_gap(mesh, {{-5, 0.2, 0.3}, {5, 0.2, 0.3}}), 0);
}

TEST(ReferenceFirstContact, TimeOfApproach) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const rendering::LineProbe before{{3, 0, 0}, {4, 0, 0}};
  const auto time = reference_first_contact(mesh, before, moved(before, {-4, 0, 0}), 10);
  ASSERT_TRUE(time);
  EXPECT_NEAR(*time, 0.5, 1e-11);
  EXPECT_GT(reference_depth(mesh, testing::mixed(before, moved(before, {-4, 0, 0}), *time)).depth,
            0);
}

TEST(ReferenceFirstContact, EmptyWhenPassingByOrOnlyTouching) {
  const stimuli::ConvexMesh mesh = cube_of_two();
  const rendering::LineProbe above{{-3, 0, 1.001}, {-3, 0, 2}};
  EXPECT_FALSE(reference_first_contact(mesh, above, moved(above, {6, 0, 0}), 100));
  const rendering::LineProbe sliding{{-3, 0, 1}, {-3, 0, 2}};
  EXPECT_FALSE(reference_first_contact(mesh, sliding, moved(sliding, {6, 0, 0}), 100));
}

TEST(ReferenceFirstContact, ZeroWhenItStartsInside) {
  const rendering::LineProbe inside{{0, 0, 0}, {0, 0, 0.1}};
  EXPECT_EQ(reference_first_contact(cube_of_two(), inside, moved(inside, {5, 0, 0}), 4), 0.0);
}

TEST(ReferenceFirstContact, SeesAsFinelyAsItsSteps) {
  const stimuli::ConvexMesh mesh(stimuli::cube(0.01));
  const rendering::LineProbe before{{0.3, 0, 0}, {0.3, 0, 1}};
  const rendering::LineProbe after = moved(before, {-1, 0, 0});
  EXPECT_FALSE(reference_first_contact(mesh, before, after, 1));
  const auto time = reference_first_contact(mesh, before, after, 1000);
  ASSERT_TRUE(time);
  EXPECT_NEAR(*time, 0.295, 1e-9);
}

// The definition of penetration depth without facets: no direction separates by a shorter
// translation.
double way_out(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe,
               const Vec3& direction) {
  double support = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : mesh.vertices()) support = std::max(support, glm::dot(direction, v));
  return support - std::min(glm::dot(direction, probe.tip), glm::dot(direction, probe.tail));
}

// The distance from the solid is convex along a segment.
double gap_by_search(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe) {
  const auto at = [&](double t) {
    return stimuli::signed_distance(mesh, probe.tip + t * (probe.tail - probe.tip)).distance;
  };
  double low = 0, high = 1;
  for (int i = 0; i < 90; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (at(a) < at(b) ? high : low) = at(a) < at(b) ? b : a;
  }
  return std::max(0.0, at((low + high) / 2));
}

TEST(ReferenceProperties, DepthIsTheShortestWayOut) {
  int inside = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {1});
    const stimuli::ConvexMesh mesh = testing::random_convex_mesh(random);
    for (const rendering::LineProbe& probe :
         testing::jumping_path(random, mesh, mesh.size() * 2 * random.unit(), 40)) {
      const ReferenceDepth found = reference_depth(mesh, probe);
      ASSERT_EQ(found.depth >= 0, reference_gap(mesh, probe) == 0) << "seed " << seed;
      if (found.depth < 0) continue;
      ++inside;
      ASSERT_NEAR(glm::length(found.normal), 1, 1e-14);
      const double tolerance = 1e-12 * (mesh.size() + glm::length(probe.tail - probe.tip));
      ASSERT_NEAR(way_out(mesh, probe, found.normal), found.depth, tolerance) << "seed " << seed;
      for (int i = 0; i < 50; ++i) {
        // Half of the directions are close to the one found, where a slightly better one would be.
        Vec3 direction = testing::random_direction(random);
        if (i % 2) direction = glm::normalize(found.normal + 0.05 * random.unit() * direction);
        ASSERT_GE(way_out(mesh, probe, direction), found.depth - tolerance) << "seed " << seed;
      }
      const rendering::LineProbe out =
          moved(probe, found.normal * (found.depth + 1e-6 * mesh.size()));
      const rendering::LineProbe in =
          moved(probe, found.normal * (found.depth - 1e-6 * mesh.size()));
      ASSERT_GT(reference_gap(mesh, out), 0) << "seed " << seed;
      if (found.depth > 1e-6 * mesh.size()) {
        ASSERT_EQ(reference_gap(mesh, in), 0) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(inside, 500);
}

TEST(ReferenceProperties, GapIsTheLeastDistanceOfAPointOfTheProbe) {
  int outside = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, {2});
    const stimuli::ConvexMesh mesh = testing::random_convex_mesh(random);
    for (const rendering::LineProbe& probe :
         testing::jumping_path(random, mesh, mesh.size() * 2 * random.unit(), 20)) {
      const double gap = reference_gap(mesh, probe);
      if (gap > 0) ++outside;
      ASSERT_NEAR(gap, gap_by_search(mesh, probe), 1e-9 * mesh.size()) << "seed " << seed;
    }
  }
  EXPECT_GT(outside, 100);
}

}  // namespace
}  // namespace palpate::runner::evidence
