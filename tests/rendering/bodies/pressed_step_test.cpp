// A step of bodies under pressing springs: gravity, damping and springs, in closed form.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "rendering/bodies/body_world.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {
namespace pressed_steps {

constexpr double kStep = 1e-3;

BodyWorldState state_of(const Scene& scene) {
  const RenderState initial = scene.initial_state();
  return body_state_of(initial);
}

/// Nothing touches: chosen bodies fall, others stay.
TEST(PressedStep, WithoutSpringsIsAFall) {
  BodyScene s;
  s.gravity = {0, 0, -9.81};
  const Mesh cube = box_mesh(Vec3(0.05));
  for (const double x : {0.0, 1.0}) {
    stimuli::Body& body = s.moves(cube, {{x, 0, 0}, {1, 0, 0, 0}}, 0.2);
    body.velocity = {0.3, 0, 1};
    body.spin = {0, 0, 2};
  }
  const Scene scene = s.scene();
  const BodyWorld& world = body_world_of(scene);
  BodyWorldState state = state_of(scene);
  const BodyMotion before = state.motion[1];
  const Vec3 momentum = state.motion[0].spin_momentum;
  const std::vector<char> chosen{1, 0};
  for (int i = 0; i < 200; ++i) step_pressed(world, state, chosen, {}, kStep);
  EXPECT_NEAR(glm::distance(state.motion[0].velocity, Vec3(0.3, 0, 1 - 9.81 * 0.2)), 0, 1e-12);
  // Steps use the speed at their end: half a step more than the parabola.
  EXPECT_NEAR(state.motion[0].centre.z, 0.2 - 9.81 / 2 * 0.2 * 0.2, 9.81 / 2 * 0.2 * kStep + 1e-12);
  EXPECT_NEAR(state.motion[0].centre.x, 0.06, 1e-12);
  EXPECT_EQ(state.motion[0].spin_momentum, momentum);
  EXPECT_NEAR(2 * std::atan2(state.motion[0].orientation.z, state.motion[0].orientation.w), 0.4,
              1e-9);
  EXPECT_EQ(state.motion[1].centre, before.centre);
  EXPECT_EQ(state.motion[1].velocity, before.velocity);
}

TEST(PressedStep, DampsSpeedAndSpin) {
  BodyScene s;
  stimuli::Body& body = s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0}, {1, 0, 0, 0}}, 0.2);
  body.velocity = {0.5, 0, 0};
  body.spin = {0, 0, 2};
  body.damping = 3;
  const Scene scene = s.scene();
  BodyWorldState state = state_of(scene);
  const Vec3 momentum = state.motion[0].spin_momentum;
  const std::vector<char> chosen{1};
  for (int i = 0; i < 500; ++i) step_pressed(body_world_of(scene), state, chosen, {}, kStep);
  EXPECT_NEAR(state.motion[0].velocity.x, 0.5 * std::exp(-1.5), 1e-12);
  EXPECT_NEAR(state.motion[0].spin_momentum.z / momentum.z, std::exp(-1.5), 1e-12);
}

/// Held against a wall by the probe, without friction, a body slides down as in free fall.
TEST(PressedStep, PressedBodySlidesDownASmoothWall) {
  BodyScene s;
  s.gravity = {0, 0, -9.81};
  const Mesh cube = box_mesh(Vec3(0.05));
  s.stands(box_mesh({0.05, 2, 2}), {{0.05, 0, 0}, {1, 0, 0, 0}});
  s.moves(cube, {{0, 0, 0}, {1, 0, 0, 0}}, 0.2).friction = 0;
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  const auto press = [&](double in, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      // Level with its centre, so that it does not turn.
      const double z = state.motion.bodies()[0].centre.z;
      const Vec3 tip(-0.025 + in, 0, z);
      point_renderer().tick(scene, state, {tip, tip - Vec3(0.12, 0, 0)}, kStep);
    }
  };
  press(-1e-3, 1);
  press(1e-3, 100);
  const auto bodies = state.motion.bodies();
  EXPECT_NEAR(bodies[0].velocity.z, -9.81 * 0.101, 0.02 * 9.81 * 0.101);
  EXPECT_NEAR(bodies[0].velocity.x, 0, 1e-3);
  EXPECT_NEAR(bodies[0].centre.x, 0, 1e-4) << "between probe and wall";
}

}  // namespace pressed_steps
}  // namespace
}  // namespace palpate::rendering::test
