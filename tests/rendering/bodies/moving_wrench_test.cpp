// What a body gives the hand, with a tool of several segments: as what stands still gives it, and
// split on two devices so that their moments are those of the contacts.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/force.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {
namespace moving_wrench {

Tool fork() {
  return {{{Vec3(0), Vec3(0, 0, 0.04)},
           {Vec3(0.01, 0, 0), Vec3(0.01, 0, 0.04)},
           {Vec3(0, 0, 0.04), Vec3(0.01, 0, 0.04)}}};
}

/// Across an upper edge of a box of 60 x 60 x 40 mm about the origin, pressed 0 to 2 mm into it.
LineProbe pressed(int i) {
  const double t = i * 1e-3;
  const Vec3 axis = glm::normalize(Vec3(1, 0.3 * std::sin(5 * t), 0.1 + 0.05 * std::cos(7 * t)));
  const Vec3 tip(-0.045 + 0.003 * t, 0.012 * std::sin(4 * t),
                 0.021 - 0.0035 * std::min(1.0, 4 * t));
  return {tip, tip + 0.12 * axis};
}

/// 1000 t: what pushes it, it does not follow. Bodies meet the probe where it comes from within the
/// tick, so up to a tick's motion.
TEST(MovingWrench, OfAHeavyBodyIsThatOfOneThatStandsStill) {
  for (const Tool& tool : {Tool{}, fork()}) {
    BodyScene moving, still;
    const Mesh mesh = box_mesh({0.06, 0.06, 0.04});
    moving.moves(mesh, {{0, 0, 0}, {1, 0, 0, 0}}, 1e6);
    still.stands(mesh, {{0, 0, 0}, {1, 0, 0, 0}});
    const Scene a = moving.scene(true, tool), b = still.scene(true, tool);
    RenderState sa = a.initial_state(), sb = b.initial_state();
    int touched = 0, split = 0;
    for (int i = 0; i < 450; ++i) {  // one prong of the fork is the deeper one all the time
      const LineProbe probe = pressed(i), last = pressed(std::max(0, i - 1));
      const Rendering ra = ray_renderer().tick(a, sa, probe, 1e-3);
      const Rendering rb = ray_renderer().tick(b, sb, probe, 1e-3);
      const double moved =
          std::max(glm::distance(probe.tip, last.tip), glm::distance(probe.tail, last.tail));
      const double force = 2 * moving.stiffness * moved + 1e-6;
      EXPECT_LE(glm::distance(ra.force, rb.force), force) << i;
      EXPECT_LE(glm::distance(ra.torque, rb.torque), 0.12 * force) << i;
      EXPECT_LE(glm::distance(ra.device1, rb.device1), force) << i;
      EXPECT_LE(glm::distance(ra.device2, rb.device2), force) << i;
      if (rb.deepest.depth < 2 * moved || rb.contacts == 0) continue;
      ++touched;
      split += glm::length(rb.device2) > 3 * force;
      EXPECT_EQ(ra.object, rb.object) << i;
      EXPECT_GT(ra.contacts, 0) << i;
      EXPECT_NEAR(ra.deepest.depth, rb.deepest.depth, 2 * moved) << i;
      EXPECT_LE(glm::distance(ra.ideal.tip, rb.ideal.tip), 3 * moved) << i;
    }
    EXPECT_GT(touched, 200);
    EXPECT_TRUE(tool.segments.empty() || split > 50) << split;
  }
}

/// Their moment about any point of the stylus is the contacts', save torsion about it.
TEST(MovingWrench, IsSplitOnTwoDevices) {
  for (const double mass : {0.05, 1.0, 1e4}) {
    for (const Tool& tool : {Tool{}, fork()}) {
      BodyScene s;
      s.stands(box_mesh({0.2, 0.2, 0.02}), {{0, 0, -0.03}, {1, 0, 0, 0}});
      s.moves(box_mesh({0.06, 0.06, 0.04}), {{0, 0, 0}, {1, 0, 0, 0}}, mass);
      const Scene scene = s.scene(true, tool);
      RenderState state = scene.initial_state();
      int turned = 0;
      for (int i = 0; i < 600; ++i) {
        const LineProbe probe = pressed(i);
        const Rendering r = ray_renderer().tick(scene, state, probe, 1e-3);
        ASSERT_NEAR(glm::distance(r.device1 + r.device2, r.force), 0,
                    1e-9 * (1 + glm::length(r.force)));
        if (r.contacts == 0) continue;
        const Vec3 axis = glm::normalize(probe.tail - probe.tip);
        const Vec3 shown = glm::cross(probe.tail - probe.tip, r.device2);
        const Vec3 missing = shown - r.torque;
        ASSERT_NEAR(glm::length(missing - glm::dot(missing, axis) * axis), 0,
                    1e-9 * (1 + glm::length(r.torque)))
            << mass << ", tick " << i;
        turned += glm::length(r.torque) > 1e-4;
      }
      EXPECT_GT(turned, 50) << mass;
    }
  }
}

}  // namespace moving_wrench
}  // namespace
}  // namespace palpate::rendering::test
