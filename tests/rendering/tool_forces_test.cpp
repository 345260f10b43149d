// Forces of the contact law of unions on the hand and on two devices.

#include <gtest/gtest.h>

#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/contact.h"
#include "rendering/renderer.h"
#include "tests/shared/random_clusters.h"

namespace palpate::rendering {
namespace {

using testing::cluster;
using testing::cluster_path;
using testing::kTick;
using testing::random_tool;

TEST(ToolForces, SplitOnTwoDevicesAndTurnTheHand) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  int off_axis = 0;
  for (int i = 0; i < 300; ++i) {
    const std::size_t segments = 1 + random.below(Tool::kMostSegments);
    const Scene scene(cluster(random), true, random_tool(random, segments));
    RenderState state = scene.initial_state();
    for (const LineProbe& probe : cluster_path(random, 60, 0.5)) {
      const Rendering r = ray_renderer().tick(scene, state, probe, kTick);
      ASSERT_LE(glm::length(r.device1 + r.device2 - r.force), 1e-9 * (1 + glm::length(r.force)));
      if (r.contacts == 0) {
        ASSERT_EQ(r.segment, -1);
        continue;
      }
      ASSERT_GE(r.segment, 0);
      ASSERT_LT(r.segment, static_cast<int>(segments));
      ASSERT_NEAR(glm::length(r.ideal_side), 1, 1e-9);
      // The two devices' moment about any point of the stylus equals the contacts', except torsion.
      const Vec3 axis = glm::normalize(probe.tail - probe.tip);
      for (const double share : {-0.5, 0.0, 0.4, 1.0}) {
        const Vec3 hand = probe.tip + share * (probe.tail - probe.tip);
        Vec3 of_contacts(0);
        for (const PlacedContact& c : state.unions.contacts)
          of_contacts += glm::cross(c.place - hand, c.loaded.force * c.loaded.contact.normal);
        const Vec3 told = r.torque + glm::cross(probe.tip - hand, r.force);
        ASSERT_LE(glm::length(told - of_contacts), 1e-9 * (1 + glm::length(told)));
        const Vec3 shown =
            glm::cross(probe.tip - hand, r.device1) + glm::cross(probe.tail - hand, r.device2);
        const Vec3 missing = shown - told;
        ASSERT_LE(glm::length(missing - glm::dot(missing, axis) * axis),
                  1e-9 * (1 + glm::length(told)));
        off_axis += glm::length(missing) > 1e-6;
      }
    }
  }
  EXPECT_GT(off_axis, 100);
}

// A joint of a tool may meet more parts at once than planes can hold it.
TEST(ToolForces, ToolTurningOntoManyCoplanarFacesMovesOn) {
  constexpr std::uint64_t kSeed = 13;
  Random random(kSeed);
  std::vector<SceneObject> parts;
  for (int i = 0; i < 6; ++i) {
    const double wide = 0.1 + 0.002 * i;
    parts.push_back(testing::placed_object(
        testing::box(Vec3(-wide, -0.1, -0.01 - 0.003 * i), Vec3(0.1, wide, 0)), {}, 800, 0));
  }
  const Tool tool{{{Vec3(0), {0, 0, 0.12}},
                   {Vec3(0), {0.02, 0.003, -0.006}},
                   {{0.02, 0.003, -0.006}, {0.03, 0.003, 0.016}}}};
  const Scene alone({parts[0]}, true, tool), beside(parts, true, tool);
  for (int i = 0; i < 100; ++i) {
    RenderState of_alone = alone.initial_state(), of_beside = beside.initial_state();
    const auto between = [&](double low, double high) {
      return low + (high - low) * random.unit();
    };
    const Vec3 start(between(-0.02, 0), between(-0.01, 0.01), 0.012);
    const Vec3 d(between(-0.2, 0.2), between(-0.2, 0.2), 1);
    const Vec3 turn(between(-0.03, 0.03), between(-0.03, 0.03), 0);
    for (int k = 0; k < 40; ++k) {
      const Vec3 tip = start + static_cast<double>(k) * Vec3(1e-4, 1e-4, -4e-4);
      const LineProbe probe{tip, tip + 0.12 * glm::normalize(d + (k / 20.0) * turn)};
      const Rendering expected = ray_renderer().tick(alone, of_alone, probe, kTick);
      const Rendering r = ray_renderer().tick(beside, of_beside, probe, kTick);
      ASSERT_EQ(r.faults, 0U) << i << " " << k;
      if (k == 39) {
        ASSERT_GT(expected.force.z, 1) << i;
        ASSERT_LE(glm::length(r.force - expected.force), 1e-9) << i;
      }
    }
  }
}

// One segment from tip to tail is the plain stylus, and so are its pieces.
TEST(ToolForces, ToolEqualToTheStylusFeelsTheSame) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  int in_contact = 0, same = 0;
  for (const std::size_t pieces : {1u, 2u, 5u, 16u}) {
    const auto mesh =
        testing::mesh_of(testing::random_polyhedron(random, 16, Vec3(0.03, 0.025, 0.02)));
    Tool tool;
    for (std::size_t j = 0; j < pieces; ++j)
      tool.segments.push_back(
          {{0, 0, 0.1 * static_cast<double>(j) / static_cast<double>(pieces)},
           {0, 0, 0.1 * static_cast<double>(j + 1) / static_cast<double>(pieces)}});
    const Scene plain({testing::placed_object(mesh)}),
        carried({testing::placed_object(mesh)}, true, tool);
    RenderState of_plain = plain.initial_state(), of_carried = carried.initial_state();
    for (const LineProbe& probe : testing::sliding_path(random, *mesh, 0.1, 300, 0.01, 0.1)) {
      const Rendering a = ray_renderer().tick(plain, of_plain, probe, kTick),
                      b = ray_renderer().tick(carried, of_carried, probe, kTick);
      in_contact += a.contacts > 0;
      same += a.contacts > 0 && glm::length(a.force - b.force) <= 1e-9;
    }
  }
  EXPECT_GT(in_contact, 600);
  EXPECT_EQ(same, in_contact);
}

}  // namespace
}  // namespace palpate::rendering
