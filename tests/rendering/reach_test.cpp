// The extended probe: the force on the hand does the same work as the contact, to rounding.

#include "rendering/reach.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "data/base/random.h"
#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

Vec3 vector(Random& random) { return {random.normal(), random.normal(), random.normal()}; }

Reach some_reach(Random& random) {
  Reach reach{.factor = 0.2 + 10 * random.unit(), .fraction = random.unit()};
  if (random.unit() < 0.3) reach.fraction = std::round(reach.fraction);
  reach.in_world = random.unit() < 0.3;
  reach.point = vector(random);
  return reach;
}

TEST(Reach, StretchesAboutThePivot) {
  const LineProbe real{{0, 0, 0}, {0, 0, 0.1}};
  const LineProbe by_tail = stretched({.factor = 5, .fraction = 1}, real);
  EXPECT_NEAR(glm::distance(by_tail.tip, Vec3(0, 0, -0.4)), 0, 1e-16);
  EXPECT_NEAR(glm::distance(by_tail.tail, real.tail), 0, 1e-16);
  const LineProbe by_grip = stretched({.factor = 3, .fraction = 0.5}, real);
  EXPECT_NEAR(glm::distance(by_grip.tip, Vec3(0, 0, -0.1)), 0, 1e-16);
  EXPECT_NEAR(glm::distance(by_grip.tail, Vec3(0, 0, 0.2)), 0, 1e-16);
  const LineProbe in_world = stretched({.factor = 2, .in_world = true, .point = {0.3, 0, 0}}, real);
  EXPECT_NEAR(glm::distance(in_world.tip, Vec3(-0.3, 0, 0)), 0, 1e-16);
  EXPECT_NEAR(glm::distance(in_world.tail, Vec3(-0.3, 0, 0.2)), 0, 1e-16);
}

TEST(Reach, IsUndoneByItsInverse) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Reach reach = some_reach(random);
    const LineProbe real{vector(random), vector(random)};
    const LineProbe back = unstretched(reach, stretched(reach, real));
    EXPECT_LT(glm::distance(back.tip, real.tip) + glm::distance(back.tail, real.tail),
              1e-13 * (1 + 1 / reach.factor));
    const EndForces forces{vector(random), vector(random)};
    const EndForces again = on_virtual(reach, felt(reach, forces));
    EXPECT_LT(glm::distance(again.tip, forces.tip) + glm::distance(again.tail, forces.tail),
              1e-13 * (1 + 1 / reach.factor));
  }
}

/// The motion of the virtual stylus for one of the real stylus: the map is linear except for the
/// fixed point.
LineProbe virtual_motion(Reach reach, const LineProbe& motion) {
  reach.point = Vec3(0);
  return stretched(reach, motion);
}

TEST(Reach, ForcesDoEqualWorkHoweverTheEndsMove) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Reach reach = some_reach(random);
    const LineProbe motion{vector(random), vector(random)};
    const LineProbe moved = virtual_motion(reach, motion);
    const EndForces forces{vector(random), vector(random)}, hand = felt(reach, forces);
    const double done = glm::dot(forces.tip, moved.tip) + glm::dot(forces.tail, moved.tail);
    const double given = glm::dot(hand.tip, motion.tip) + glm::dot(hand.tail, motion.tail);
    const double size = glm::length(forces.tip) * glm::length(moved.tip) +
                        glm::length(forces.tail) * glm::length(moved.tail);
    EXPECT_NEAR(given, done, 1e-14 * size);
    const Vec3 sum = hand.tip + hand.tail, all = forces.tip + forces.tail;
    const double gain = reach.in_world ? reach.factor : 1;
    EXPECT_LT(glm::distance(sum, gain * all), 1e-13 * glm::length(all) * (1 + reach.factor));
  }
}

// A cube far from the hand, pressed by the side of a virtual stylus of 0.6 m; the real one has 0.12
// m.
TEST(Reach, ContactForceDoesEqualWorkAtTheHand) {
  std::vector<SceneObject> objects(1);
  objects[0].mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.05));
  const Scene scene(std::move(objects));
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  int contacts = 0;
  for (int i = 0; i < 300; ++i) {
    Reach reach{.factor = 5, .fraction = i % 2 == 0 ? 1 : 0.5};
    const Vec3 axis = glm::normalize(Vec3(1, 0.1 * random.normal(), 0.1 * random.normal()));
    const double along = 0.5 * random.unit() - 0.02;
    RenderState state = scene.initial_state();
    Rendering r;
    LineProbe real;
    for (const double height : {0.03, 0.0245}) {  // over an upper edge, then into it
      const Vec3 middle(0, 0.9 * height, height);
      real = unstretched(reach, {middle - along * axis, middle + (0.6 - along) * axis});
      r = ray_renderer().tick(scene, state, stretched(reach, real), 1e-3);
    }
    if (r.contacts == 0) continue;
    ++contacts;
    const Rendering hand = felt(reach, r);
    const LineProbe motion{vector(random), vector(random)}, moved = virtual_motion(reach, motion);
    const Vec3 d = r.ideal.tail - r.ideal.tip;
    const double place = glm::dot(r.deepest.point - r.ideal.tip, d) / glm::dot(d, d);
    const double done = glm::dot(r.force, (1 - place) * moved.tip + place * moved.tail);
    const double given = glm::dot(hand.device1, motion.tip) + glm::dot(hand.device2, motion.tail);
    EXPECT_NEAR(given, done, 1e-12 * glm::length(r.force));
    EXPECT_EQ(hand.torque, r.torque);
    EXPECT_LT(glm::distance(hand.force, r.force), 1e-14);
  }
  EXPECT_GT(contacts, 200);
}

TEST(Reach, TheGainIsTheSquareOfTheLever) {
  EXPECT_EQ(stiffness_gain({}, 0), 1);
  EXPECT_EQ(stiffness_gain({}, 1), 1);
  EXPECT_EQ(stiffness_gain({}, 0.5), 0.5);
  EXPECT_NEAR(stiffness_gain({.factor = 3, .in_world = true}, 0), 9, 1e-15);
  // Stretched five times about the tail, the tip moves by 5 of the real tip less 4 of the tail.
  EXPECT_NEAR(stiffness_gain({.factor = 5, .fraction = 1}, 0), 25 + 16, 1e-13);
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (int i = 0; i < 1000; ++i) {
    const Reach reach = some_reach(random);
    const double along = random.unit(), k = 700;
    const Vec3 n = glm::normalize(vector(random));
    // The greatest stiffness that the ends feel: K = k g g^T, with g the forces on the ends by a
    // unit force; its only positive eigenvalue is k g.g.
    const EndForces g = felt(reach, EndForces{(1 - along) * n, along * n});
    EXPECT_NEAR(k * (glm::dot(g.tip, g.tip) + glm::dot(g.tail, g.tail)),
                k * stiffness_gain(reach, along), 1e-9 * k);
  }
}

}  // namespace
}  // namespace palpate::rendering
