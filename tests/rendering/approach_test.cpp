// Tracking the probe before the contact gives the same first contact as testing every facet and
// edge.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/contact_detection.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_mesh.h"

namespace palpate::rendering {
namespace {

using testing::uniform;
using Kind = ContactFeature::Kind;

struct Counts {
  int entered = 0, separated = 0, undecided = 0;
};

/// One random motion near the mesh, from a place where a walk finds the probe outside. `turn`: rad.
void check_motion(const stimuli::ConvexMesh& mesh, const ContactTrees& trees, Random& random,
                  bool segment, double way, double turn, Counts& counts) {
  const double size = mesh.size();
  const double length = segment ? size * uniform(random, 0.01, 3) : 0;
  const Vec3 near = testing::middle_of(mesh) + 0.6 * size * testing::random_direction(random);
  const double share = random.unit();
  const Vec3 axis = testing::random_direction(random);
  const LineProbe before = testing::probe_at(near, axis, length, share);
  const Vec3 turned = glm::normalize(axis + turn * testing::random_direction(random));
  // Towards the inside, the outside, or along.
  const Vec3 to = near + way * size *
                             glm::normalize(testing::middle_of(mesh) - near +
                                            size * testing::random_direction(random));
  const LineProbe after = testing::probe_at(to, turned, length, share);
  const ContactFeature any(Kind::facet, false,
                           static_cast<std::uint32_t>(random.below(mesh.facets().size())));
  const WalkResult was = segment ? walk_segment(mesh, any, before.tip, before.tail - before.tip)
                                 : walk_point(mesh, any, before.tip);
  if (was.feature.kind != Kind::none || was.depth > -1e-9 * size) return;  // inside, or almost
  const Approach way_in = segment ? approach_segment(mesh, was.separating_feature, before, after)
                                  : approach_point(mesh, was.separating_feature, before, after);
  const double tolerance = 1e-12 * size;
  const FirstContact first =
      segment ? first_contact_segment(mesh, trees, before, after, tolerance)
              : first_contact_point(mesh, trees, before.tip, after.tip, tolerance);
  switch (way_in.end) {
    case Approach::End::undecided:
      ++counts.undecided;
      return;
    case Approach::End::separated:
      ++counts.separated;
      EXPECT_GE(std::min(glm::dot(way_in.plane.normal, after.tip),
                         glm::dot(way_in.plane.normal, segment ? after.tail : after.tip)),
                way_in.plane.offset - tolerance);
      for (const Vec3& vertex : mesh.vertices())
        ASSERT_LE(glm::dot(way_in.plane.normal, vertex), way_in.plane.offset + tolerance);
      EXPECT_EQ(first.feature.kind, Kind::none);
      return;
    case Approach::End::entered:
      ++counts.entered;
      ASSERT_NE(first.feature.kind, Kind::none);
      EXPECT_NEAR(way_in.time, first.time, 1e-7);
  }
}

Counts check_motions(bool segment, double way, double turn, std::uint64_t stream) {
  Counts counts;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    Random random(seed, {77, stream});
    const stimuli::ConvexMesh mesh = testing::random_convex_mesh(random);
    const ContactTrees trees(mesh, true);
    for (int i = 0; i < 10; ++i) check_motion(mesh, trees, random, segment, way, turn, counts);
    if (::testing::Test::HasFailure()) {
      ADD_FAILURE() << "seed " << seed;
      break;
    }
  }
  return counts;
}

TEST(Approach, TipEndsAsLookingEverywhereDoes) {
  const Counts counts = check_motions(false, 0.5, 0, 1);
  EXPECT_GT(counts.entered, 300);
  EXPECT_GT(counts.separated, 300);
  EXPECT_EQ(counts.undecided, 0);
}

TEST(Approach, SlowlyTurningStylusEndsAsLookingEverywhereDoes) {
  const Counts counts = check_motions(true, 0.3, 0.05, 2);
  EXPECT_GT(counts.entered, 300);
  EXPECT_GT(counts.separated, 300);
  EXPECT_LE(counts.undecided, (counts.entered + counts.separated) / 100);
}

TEST(Approach, WhirledStylusEndsAsLookingEverywhereDoes) {
  const Counts counts = check_motions(true, 1, 2, 3);
  EXPECT_GT(counts.entered, 300);
  EXPECT_GT(counts.separated, 300);
  EXPECT_LE(counts.undecided, (counts.entered + counts.separated) / 20);
}

TEST(SupportMap, LeadsToTheFarthestVertexInFewSteps) {
  const stimuli::ConvexMesh mesh(stimuli::icosphere(0.03, 6));
  const stimuli::SupportMap map(mesh);
  ASSERT_FALSE(map.empty());
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 direction = 3.0 * testing::random_direction(random);
    const Vec3& near = mesh.vertices()[map.near_support(direction)];
    double best = -1;
    for (const Vec3& vertex : mesh.vertices()) best = std::max(best, glm::dot(vertex, direction));
    EXPECT_EQ(
        glm::dot(
            mesh.vertices()[stimuli::support_vertex(mesh, direction, map.near_support(direction))],
            direction),
        best);
    EXPECT_GT(glm::dot(near, direction), 3 * 0.03 * std::cos(0.06));  // a cell: some 0.06 rad
  }
  EXPECT_TRUE(stimuli::SupportMap(stimuli::ConvexMesh(stimuli::cube(0.1))).empty());
}

}  // namespace
}  // namespace palpate::rendering
