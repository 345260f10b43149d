#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_world.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {

constexpr Quat kUprightBody{1, 0, 0, 0};

/// A stack of ten cubes of 5 cm on a floor.
BodyScene stack_of_ten() {
  BodyScene s;
  s.gravity = {0, 0, -9.81};
  s.stands(box_mesh({1, 1, 0.1}), {{0, 0, -0.05}, kUprightBody});
  for (int i = 0; i < 10; ++i)
    s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0.025 + 0.05 * i}, kUprightBody}, 0.1);
  return s;
}

std::size_t sleeping(const RenderState& state) { return body_state_of(state).sleeping; }

double farthest_off(const RenderState& state) {
  double worst = 0;
  for (std::size_t i = 0; i < 10; ++i)
    worst = std::max(worst, glm::distance(state.motion.bodies()[i].centre,
                                          Vec3(0, 0, 0.025 + 0.05 * static_cast<double>(i))));
  return worst;
}

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TEST(BodySleep, RestingStackFallsAsleepAndStaysInPlace) {
  const Scene scene = stack_of_ten().scene();
  RenderState state = scene.initial_state();
  run(scene, state, 0.3);
  EXPECT_EQ(sleeping(state), 0U);
  run(scene, state, 0.5);
  ASSERT_EQ(sleeping(state), 10U);
  EXPECT_LE(farthest_off(state), 1e-6);
  std::vector<Vec3> places;
  for (const BodyPose& body : state.motion.bodies()) places.push_back(body.centre);
  run(scene, state, 60);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(state.motion.bodies()[i].centre, places[i]) << i;
    EXPECT_EQ(state.motion.bodies()[i].velocity, Vec3(0)) << i;
  }
}

/// At most a twentieth of the cost awake (found: a two hundredth). Processor time, the least of
/// several runs.
TEST(BodySleep, AllAsleepCostsNearlyNothing) {
  BodyScene restless = stack_of_ten();
  restless.sleeps = false;
  const Scene scenes[] = {stack_of_ten().scene(), restless.scene()};
  double least[] = {1e9, 1e9};
  for (int i = 0; i < 2; ++i) {
    RenderState state = scenes[i].initial_state();
    run(scenes[i], state, i == 0 ? 0.8 : 0.02);
    ASSERT_EQ(sleeping(state), i == 0 ? 10U : 0U);
    for (int round = 0; round < 5; ++round) {
      const double before = processor_seconds();
      run(scenes[i], state, 0.01);
      least[i] = std::min(least[i], processor_seconds() - before);
    }
  }
  EXPECT_LT(least[0], 0.05 * least[1]);
}

TEST(BodySleep, AFallingBodyWakesSleepers) {
  BodyScene s = stack_of_ten();
  s.moves(box_mesh(Vec3(0.03)), {{0.01, 0, 6}, kUprightBody}, 0.5);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 1.0);
  EXPECT_EQ(sleeping(state), 10U);
  run(scene, state, 0.15);  // a fall of 5.5 m takes 1.05 s
  EXPECT_EQ(sleeping(state), 0U);
  EXPECT_GT(farthest_off(state), 1e-4);
}

TEST(BodySleep, ProbeWakesTheTouchedBodysWholeStack) {
  const Scene scene = stack_of_ten().scene();
  RenderState state = scene.initial_state();
  LineProbe probe{{0.1, 0, 0.275}, {0.22, 0, 0.275}};
  run(scene, state, 1.0, 1e-3, probe);
  ASSERT_EQ(sleeping(state), 10U);
  // Slowly against the sixth cube, and away again before it moves.
  double touched = 0;
  for (int i = 0; i < 800; ++i) {
    probe.tip.x = probe.tail.x - 0.12;
    probe.tail.x -= i < 400 ? 0.00019 : -0.00019;
    const Rendering r = point_renderer().tick(scene, state, probe, 1e-3);
    if (r.contacts > 0) {
      EXPECT_EQ(sleeping(state), 0U);
      touched = std::max(touched, r.force.x);
    }
  }
  EXPECT_GT(touched, 0.1);
  run(scene, state, 2.0, 1e-3, probe);
  EXPECT_EQ(sleeping(state), 10U);
  EXPECT_LE(glm::length(state.motion.bodies()[9].velocity), 0);
}

/// Slower than can be felt, but moving.
TEST(BodySleep, ADriftingBodyDoesNotSleep) {
  BodyScene s;
  s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0}, kUprightBody}, 0.1).velocity = {1e-8, 0, 0};
  s.moves(box_mesh(Vec3(0.05)), {{0, 1, 0}, kUprightBody}, 0.1);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 3);
  EXPECT_EQ(sleeping(state), 1U);
  EXPECT_EQ(state.motion.bodies()[0].velocity, Vec3(1e-8, 0, 0));
  EXPECT_NEAR(state.motion.bodies()[0].centre.x, 3e-8, 1e-15);
}

TEST(BodySleep, CopiedSleepingStatesWakeTheSame) {
  BodyScene s = stack_of_ten();
  s.moves(box_mesh(Vec3(0.03)), {{0.01, 0, 6}, kUprightBody}, 0.5);
  const Scene scene = s.scene();
  RenderState a = scene.initial_state();
  run(scene, a, 0.9);
  RenderState b = a;
  run(scene, a, 0.6);
  run(scene, b, 0.6);
  for (std::size_t i = 0; i < 11; ++i)
    EXPECT_EQ(a.motion.bodies()[i].centre, b.motion.bodies()[i].centre) << i;
}

}  // namespace
}  // namespace palpate::rendering::test
