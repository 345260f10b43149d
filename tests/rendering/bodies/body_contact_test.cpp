// Contacts between bodies, against known answers.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "data/base/random.h"
#include "rendering/bodies/body_meetings.h"
#include "rendering/bodies/body_world.h"
#include "rendering/scene_motion.h"
#include "runner/evidence/tick_meters.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {

double between(Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

stimuli::Body& elastic(stimuli::Body& body) {
  body.restitution = 1;
  body.friction = 0;
  return body;
}

TEST(BodyContact, HeadOnFirstStopsAndSecondMoves) {
  BodyScene s;
  const Mesh cube = box_mesh(Vec3(0.05));
  elastic(s.moves(cube, {{0, 0, 0}, {1, 0, 0, 0}}, 0.2)).velocity = {1, 0, 0};
  elastic(s.moves(cube, {{0.1237, 0, 0}, {1, 0, 0, 0}}, 0.2));
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 0.2);
  const auto bodies = state.motion.bodies();
  EXPECT_NEAR(glm::length(bodies[0].velocity), 0, 1e-12);
  EXPECT_NEAR(glm::distance(bodies[1].velocity, Vec3(1, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(bodies[1].spin), 0, 1e-9);
  // The place of meeting follows from the time of meeting.
  EXPECT_NEAR(bodies[0].centre.x, 0.0737, 1e-7);
  EXPECT_NEAR(bodies[1].centre.x, 0.1237 + 0.2 - 0.0737, 1e-7);
}

TEST(BodyContact, HeadOnUnequalMassesAndRestitution) {
  for (const double restitution : {0.0, 0.3, 1.0}) {
    BodyScene s;
    const Mesh cube = box_mesh(Vec3(0.05));
    stimuli::Body& a = s.moves(cube, {{0, 0, 0}, {1, 0, 0, 0}}, 2);
    a.velocity = {0.7, 0, 0};
    a.restitution = restitution;
    s.moves(cube, {{0.1, 0.01, 0.013}, {1, 0, 0, 0}}, 0.3).restitution = restitution;
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const Vec3 before = 2.0 * Vec3(0.7, 0, 0);
    run(scene, state, 0.2);
    const auto bodies = state.motion.bodies();
    EXPECT_NEAR(glm::distance(2.0 * bodies[0].velocity + 0.3 * bodies[1].velocity, before), 0,
                1e-12);
  }
}

/// Balls as polyhedra that meet face to face: known normals, no friction.
TEST(BodyContact, ObliqueTheSpeedAlongTheFaceStays) {
  BodyScene s;
  const Mesh cube = box_mesh(Vec3(0.05));
  elastic(s.moves(cube, {{0, 0, 0}, {1, 0, 0, 0}}, 0.2)).velocity = {1, 0.02, -0.03};
  s.stands(box_mesh({0.05, 1, 1}), {{0.11, 0, 0}, {1, 0, 0, 0}});
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 0.1);
  EXPECT_NEAR(glm::distance(state.motion.bodies()[0].velocity, Vec3(-1, 0.02, -0.03)), 0, 1e-9);
  EXPECT_NEAR(glm::length(state.motion.bodies()[0].spin), 0, 1e-7);
}

/// A rod at rest, struck at its end by the tip of a cone, in closed form: the impulse by the
/// effective mass of both at the place.
TEST(BodyContact, RodStruckAtItsEnd) {
  BodyScene s;
  const double length = 0.4, width = 0.02, rod_mass = 0.5, mass = 0.1, speed = 0.8;
  const double arm = 0.19;
  elastic(s.moves(box_mesh({length, width, width}), {{0, 0, 0}, {1, 0, 0, 0}}, rod_mass));
  // The cone's tip points along -y, its axis through its centre of mass: no spin of its own.
  const Quat down = glm::angleAxis(std::acos(-1) / 2, Vec3(1, 0, 0));
  elastic(s.moves(mesh_of(stimuli::cone(0.01, 0.04, 16)), {{arm, 0.1, 0}, down}, mass)).velocity = {
      0, -speed, 0};
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  const auto bodies = state.motion.bodies();
  ASSERT_LT((bodies[1].orientation * Vec3(0, 0, 1)).y, -0.99);
  run(scene, state, 0.2);
  const double inertia = rod_mass / 12 * (length * length + width * width);
  const double per_mass = 1 / mass + 1 / rod_mass + arm * arm / inertia;
  const double impulse = 2 * speed / per_mass;
  EXPECT_NEAR(bodies[1].velocity.y, -speed + impulse / mass, 1e-6);
  EXPECT_NEAR(bodies[0].velocity.y, -impulse / rod_mass, 1e-6);
  EXPECT_NEAR(bodies[0].spin.z, -impulse * arm / inertia, 1e-5);
  EXPECT_NEAR(bodies[0].spin.x, 0, 1e-6);
}

TEST(BodyContact, NewtonsCradle) {
  for (const int moving : {1, 2, 3}) {
    BodyScene s;
    const Mesh cube = box_mesh(Vec3(0.04));
    for (int i = 0; i < 5; ++i) {
      elastic(s.moves(cube, {{0.04 * i - (i < moving ? 0.05 : 0), 0, 0}, {1, 0, 0, 0}}, 0.1))
          .velocity = {i < moving ? 1.0 : 0.0, 0, 0};
    }
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    run(scene, state, 0.1);
    const auto bodies = state.motion.bodies();
    for (int i = 0; i < 5; ++i)
      EXPECT_NEAR(bodies[i].velocity.x, i >= 5 - moving ? 1 : 0, 1e-6) << moving << i;
  }
}

TEST(BodyContact, CradleOfBalls) {
  BodyScene s;
  const Mesh ball = mesh_of(stimuli::icosphere(0.02, 3));
  // An icosphere has corners on the axes: they touch there.
  for (int i = 0; i < 5; ++i)
    elastic(s.moves(ball, {{0, 0, 0.04 * i - (i < 1 ? 0.05 : 0)}, {1, 0, 0, 0}}, 0.1)).velocity = {
        0, 0, i < 1 ? 1.0 : 0.0};
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  double top = -1;
  for (const Vec3& v : ball->vertices()) top = std::max(top, v.z);
  run(scene, state, 0.1);
  const auto bodies = state.motion.bodies();
  Vec3 momentum(0);
  for (const BodyPose& body : bodies) momentum += body.velocity;
  EXPECT_NEAR(glm::distance(momentum, Vec3(0, 0, 1)), 0, 1e-12);
  if (top > 0.0199999) {
    EXPECT_NEAR(bodies[4].velocity.z, 1, 1e-6);
  }
}

TEST(BodyContact, HeavyOnLightSinksAtMostTenMicrometres) {
  BodyScene s;
  s.sleeps = false;
  s.gravity = {0, 0, -9.81};
  s.stands(box_mesh({1, 1, 0.1}), {{0, 0, -0.05}, {1, 0, 0, 0}});
  s.moves(box_mesh(Vec3(0.02)), {{0, 0, 0.01}, {1, 0, 0, 0}}, 0.001);
  s.moves(box_mesh(Vec3(0.1)), {{0, 0, 0.07}, {1, 0, 0, 0}}, 10);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    run(scene, state, 1e-3);
    worst = std::max({worst, std::abs(state.motion.bodies()[0].centre.z - 0.01),
                      std::abs(state.motion.bodies()[1].centre.z - 0.07)});
  }
  EXPECT_LE(worst, 1e-5);
}

TEST(BodyContact, AStackOfTenRests) {
  BodyScene s;
  s.sleeps = false;
  s.gravity = {0, 0, -9.81};
  s.stands(box_mesh({1, 1, 0.1}), {{0, 0, -0.05}, {1, 0, 0, 0}});
  for (int i = 0; i < 10; ++i)
    s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0.025 + 0.05 * i}, {1, 0, 0, 0}}, 0.1);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 4);
  const auto bodies = state.motion.bodies();
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_NEAR(glm::distance(bodies[i].centre, Vec3(0, 0, 0.025 + 0.05 * static_cast<double>(i))),
                0, 1e-5)
        << i;
    EXPECT_LE(glm::length(bodies[i].velocity), 1e-4) << i;
  }
}

/// On a slope a body stays if the friction coefficient is above the tangent; else it slides with g
/// (sin - mu cos).
TEST(BodyContact, SlopeAndFriction) {
  const double angle = 0.35;
  for (const double friction : {0.0, 0.2, 0.6}) {
    BodyScene s;
    const Quat turn = glm::angleAxis(angle, Vec3(0, 1, 0));
    s.gravity = {0, 0, -9.81};
    s.stands(box_mesh({4, 1, 0.1}), {turn * Vec3(0, 0, -0.05), turn});
    s.moves(box_mesh(Vec3(0.05)), {turn * Vec3(0, 0, 0.025), turn}, 0.1).friction = friction;
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    run(scene, state, 0.5);
    const double expected =
        0.5 * std::max(0.0, 9.81 * (std::sin(angle) - friction * std::cos(angle)));
    const Vec3 down = turn * Vec3(1, 0, 0);
    EXPECT_NEAR(glm::dot(state.motion.bodies()[0].velocity, down), expected, 2e-3) << friction;
  }
}

/// Contacts between bodies conserve momentum and do not increase energy.
TEST(BodyContact, MomentumStaysWhateverHappens) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int trial = 0; trial < 12; ++trial) {
    BodyScene s;
    const double restitution = trial % 3 == 0 ? 1 : 0.4;
    for (int i = 0; i < 6; ++i) {
      const Vec3 place(0.12 * (i % 3), i < 3 ? 0 : 0.12, between(random, -0.02, 0.02));
      const Mesh mesh =
          i % 2 == 0 ? box_mesh({0.08, 0.05, 0.06}) : mesh_of(stimuli::icosphere(0.03, 2));
      const Quat q = glm::normalize(
          Quat(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1), 0.3));
      stimuli::Body& body = s.moves(mesh, {place, q}, i == 0 ? 5 : between(random, 0.01, 0.3));
      body.restitution = restitution;
      body.friction = trial % 2 == 0 ? 0 : 0.3;
      body.velocity = 2.0 * (Vec3(0.12, 0.06, 0) - place) / 0.1;
      body.spin = {between(random, -9, 9), between(random, -9, 9), between(random, -9, 9)};
    }
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const auto measure = [&] {
      const auto& world = body_world_of(scene);
      const auto& inner = body_state_of(state);
      return std::tuple(momentum(world, inner), angular_momentum(world, inner),
                        kinetic_energy(world, inner));
    };
    const auto [p, l, e] = measure();
    const double scale = 5 * 2;
    double highest = e;
    for (int i = 0; i < 500; ++i) {
      run(scene, state, 1e-3);
      const auto [p2, l2, e2] = measure();
      EXPECT_LE(glm::distance(p, p2), 1e-12 * scale) << trial << " " << i;
      EXPECT_LE(glm::distance(l, l2), 1e-7 * scale) << trial << " " << i;
      EXPECT_LE(e2, highest * (1 + 1e-3)) << trial << " " << i;
    }
  }
}

/// Old remembered distances and old ends of searches hide no contact: the near parts are those that
/// a state without memory finds.
TEST(BodyContact, RememberedDistancesHideNoContact) {
  constexpr std::uint64_t kSeed = 21;
  Random random(kSeed);
  const Mesh ball = mesh_of(stimuli::icosphere(0.015, 2)), bar = box_mesh({0.06, 0.01, 0.01});
  std::size_t found = 0;
  for (int trial = 0; trial < 4; ++trial) {
    BodyScene s;
    for (int i = 0; i < 6; ++i) {
      const Vec3 place(0.12 * (i % 3), i < 3 ? 0 : 0.12, 0.01 * i);
      const Quat q = glm::normalize(
          Quat(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1), 0.3));
      stimuli::Body& body = s.moves(
          {{ball, {{0.03, 0, 0}, {1, 0, 0, 0}}}, {ball, {{-0.03, 0, 0}, {1, 0, 0, 0}}}, {bar, {}}},
          {place, q}, 0.1);
      body.restitution = 0.9;
      body.velocity = (Vec3(0.12, 0.06, 0) - place) / 0.1;
      body.spin = {between(random, -9, 9), between(random, -9, 9), between(random, -9, 9)};
    }
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const BodyWorld& world = body_world_of(scene);
    for (int i = 0; i < 400; ++i) {
      run(scene, state, 1e-3);
      BodyWorldState known = body_state_of(state), fresh = initial_state(world);
      known.make_room();
      fresh.motion = known.motion;
      constexpr double kFar = 2e-3;
      BodyMeetings(world, known).find(0, kFar);
      BodyMeetings(world, fresh).find(0, kFar);
      const auto gap_in = [](const BodyWorldState& of, std::uint32_t parts) {
        for (const auto& near : of.near_parts) {
          if (near.parts == parts) return near.gap;
        }
        return kFar;
      };
      for (std::uint32_t parts = 0; parts < world.part_pairs.size(); ++parts)
        EXPECT_NEAR(gap_in(known, parts), gap_in(fresh, parts), 1e-7) << trial << " " << i;
      found += fresh.near_parts.size();
    }
  }
  EXPECT_GT(found, 300U);
}

TEST(BodyContact, FastOnesDoNotPassThroughThinWalls) {
  for (const double speed : {1.0, 10.0, 60.0}) {
    BodyScene s;
    elastic(s.moves(box_mesh(Vec3(0.01)),
                    {{0.003, 0.001, 0.002}, glm::normalize(Quat(1, 0.1, 0.2, 0.3))}, 0.001))
        .velocity = {speed, 0, 0};
    s.stands(box_mesh({0.001, 1, 1}), {{0.5, 0, 0}, {1, 0, 0, 0}});
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    run(scene, state, 1);
    EXPECT_LT(state.motion.bodies()[0].centre.x, 0.5) << speed;
  }
}

TEST(BodyContact, StepsDoNotAllocate) {
  BodyScene s;
  s.gravity = {0, 0, -9.81};
  s.stands(box_mesh({1, 1, 0.1}), {{0, 0, -0.05}, {1, 0, 0, 0}});
  for (int i = 0; i < 4; ++i)
    s.moves(box_mesh(Vec3(0.05)), {{0.01 * i, 0, 0.08 + 0.07 * i}, {1, 0, 0, 0}}, 0.1).spin = {1, 2,
                                                                                               3};
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 0.1);
  const std::uint64_t before = runner::evidence::allocations();
  run(scene, state, 0.7);
  EXPECT_EQ(runner::evidence::allocations() - before, 0U);
}

}  // namespace
}  // namespace palpate::rendering::test
