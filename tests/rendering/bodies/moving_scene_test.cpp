// Contact of the probe with bodies.

#include "rendering/bodies/moving_scene.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "stimuli/closed_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/surfaces/surface.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {

LineProbe pointing(const Vec3& tip) { return {tip, tip + Vec3(0.12, 0, 0)}; }

/// A cube flies against the tip, held still, and returns with its speed; the hand gets the change
/// of its momentum.
TEST(MovingScene, CubeLeavesTheTipWithItsEnergy) {
  for (const double mass : {1e-3, 0.1, 10.0}) {
    for (const double stiffness : {200.0, 3000.0, 5e4}) {
      for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
        BodyScene s;
        s.stiffness = stiffness;
        s.moves(box_mesh(Vec3(0.05)), {{-0.05, 0, 0}, {1, 0, 0, 0}}, mass).velocity = {0.3, 0, 0};
        const Scene scene = s.scene(renderer->side_contact());
        RenderState state = scene.initial_state();
        const LineProbe probe = pointing({0, 0, 0});
        Vec3 impulse(0);
        renderer->tick(scene, state, probe, 0);
        const BodyPose& body = state.motion.bodies()[0];
        for (int i = 0; i < 3000 && !(body.velocity.x < 0 && body.centre.x < -0.05); ++i)
          impulse += 1e-3 * renderer->tick(scene, state, probe, 1e-3).force;
        EXPECT_NEAR(body.velocity.x / -0.3, 1, 0.5e-9) << mass << " " << stiffness;
        EXPECT_NEAR(impulse.x / (2 * mass * 0.3), 1, 1e-9);
        EXPECT_NEAR(glm::length(body.spin), 0, 1e-9);
      }
    }
  }
}

/// Struck off-centre it also turns; it loses the momentum that it gives the hand.
TEST(MovingScene, PushOffCentreTurnsItAndMomentaBalance) {
  BodyScene s;
  s.moves(box_mesh({0.05, 0.1, 0.05}), {{-0.05, 0, 0}, {1, 0, 0, 0}}, 0.1);
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  Vec3 impulse(0), moment(0);
  LineProbe probe = pointing({0, 0.03, 0});
  ray_renderer().tick(scene, state, probe, 0);
  for (int i = 0; i < 200; ++i) {
    probe.tip.x -= 0.0003;
    probe.tail.x -= 0.0003;
    const Rendering r = ray_renderer().tick(scene, state, probe, 1e-3);
    impulse += 1e-3 * r.force;
    moment += 1e-3 * (r.torque + glm::cross(probe.tip, r.force));
    EXPECT_TRUE(std::isfinite(r.force.x));
  }
  const BodyPose& body = state.motion.bodies()[0];
  EXPECT_LT(body.velocity.x, 0);
  EXPECT_GT(std::abs(body.spin.z), 0.1);
  EXPECT_NEAR(glm::distance(0.1 * body.velocity, -impulse), 0, 1e-12);
  const BodyWorldState& inner = body_state_of(state);
  EXPECT_NEAR(glm::distance(angular_momentum(body_world_of(scene), inner), -moment), 0, 1e-5);
}

/// A body that strikes a stylus fast makes steps of its own within a tick. The ideal stylus is the
/// virtual one moved out of the body and not turned, whatever the body's orientation.
TEST(MovingScene, FastBodyDoesNotTurnTheIdealStylus) {
  for (const double angle : {0.0, 0.4, 1.2, 2.5}) {
    BodyScene s;
    // About an axis other than the stylus's; else its direction would be the same in the body's
    // frame.
    s.moves(box_mesh(Vec3(0.05)), {{-0.06, 0, 0}, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}},
            0.05)
        .velocity = {1.5, 0, 0};
    const Scene scene = s.scene();
    RenderState state = scene.initial_state();
    const LineProbe probe = pointing({0, 0, 0});
    ray_renderer().tick(scene, state, probe, 0);
    int touched = 0;
    for (int i = 0; i < 60; ++i) {
      const Rendering r = ray_renderer().tick(scene, state, probe, 1e-3);
      if (r.contacts == 0) continue;
      ++touched;
      EXPECT_LT(glm::distance(r.ideal.tail - r.ideal.tip, probe.tail - probe.tip), 1e-9) << angle;
    }
    EXPECT_GT(touched, 3) << angle;
  }
}

TEST(MovingScene, TipToWallForceIsStiffnessTimesDepth) {
  for (const double mass : {1e-3, 0.1}) {
    for (const double stiffness : {1000.0, 5e4}) {
      BodyScene s;
      s.stiffness = stiffness;
      s.stands(box_mesh({0.1, 1, 1}), {{-0.05, 0, 0}, {1, 0, 0, 0}});
      s.moves(box_mesh(Vec3(0.05)), {{0.025, 0, 0}, {1, 0, 0, 0}}, mass);
      const Scene scene = s.scene();
      RenderState state = scene.initial_state();
      LineProbe probe = pointing({0.051, 0, 0});
      ray_renderer().tick(scene, state, probe, 0);
      Rendering r;
      for (int i = 0; i < 3000; ++i) {
        const double depth = i < 1000 ? 0.002 * i / 1000 : 0.002;
        probe = pointing({0.05 - depth, 0, 0});
        r = ray_renderer().tick(scene, state, probe, 1e-3);
        EXPECT_TRUE(std::isfinite(r.force.x));
        EXPECT_LE(r.force.x, 1.2 * stiffness * 0.002);
        EXPECT_NEAR(state.motion.bodies()[0].centre.x, 0.025, 1e-5) << i;
      }
      EXPECT_NEAR(r.force.x, stiffness * 0.002, 1e-3 * stiffness * 0.002) << mass;
      EXPECT_NEAR(glm::length(state.motion.bodies()[0].velocity), 0, 1e-6);
    }
  }
}

/// A heavy body at rest feels like a fixed one.
TEST(MovingScene, AHeavyBodyFeelsLikeAWall) {
  const Mesh mesh = mesh_of(stimuli::icosphere(0.03, 3));
  const Quat q = glm::normalize(Quat(1, 0.2, 0.3, 0.4));
  BodyScene moving, still;
  moving.moves(mesh, {{0.01, 0.02, 0.03}, q}, 1e4);
  still.stands(mesh, {{0.01, 0.02, 0.03}, q});
  const Scene a = moving.scene(), b = still.scene();
  EXPECT_EQ(b.motion(), nullptr);
  RenderState sa = a.initial_state(), sb = b.initial_state();
  double most = 0;
  for (int i = 0; i < 400; ++i) {
    const double t = i * 1e-3;
    const LineProbe probe{{0.05 - 0.06 * t, 0.02 * t, 0.04}, {0.15, 0.05, 0.06}};
    const Rendering ra = ray_renderer().tick(a, sa, probe, 1e-3);
    const Rendering rb = ray_renderer().tick(b, sb, probe, 1e-3);
    most = std::max(most, glm::length(rb.force));
    EXPECT_NEAR(glm::distance(ra.force, rb.force), 0, 0.1) << i;
    EXPECT_NEAR(glm::distance(ra.torque, rb.torque), 0, 0.01) << i;
    EXPECT_EQ(ra.object, rb.object) << i;
  }
  EXPECT_GT(most, 1);
}

TEST(MovingScene, NaNTailReachesNeitherHandNorBody) {
  BodyScene s;
  s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0}, {1, 0, 0, 0}}, 0.1).velocity = {0.1, 0, 0};
  const Scene scene = s.scene();
  RenderState state = scene.initial_state();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 300; ++i) {
    LineProbe probe = pointing({0.04, 0, 0});
    if (i % 7 == 3) probe.tail.y = nan;
    if (i % 11 == 5) probe.tip.x = std::numeric_limits<double>::infinity();
    const Rendering r = ray_renderer().tick(scene, state, probe, 1e-3);
    for (const Vec3& v : {r.force, r.torque, r.device1, r.device2})
      EXPECT_TRUE(std::isfinite(v.x + v.y + v.z)) << i;
    const BodyPose& body = state.motion.bodies()[0];
    EXPECT_TRUE(std::isfinite(body.centre.x + body.velocity.x + body.orientation.w));
  }
}

TEST(MovingScene, RefusesScenesBeyondALimitNamingIt) {
  BodyScene s;
  s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0}, {1, 0, 0, 0}}, 1e-3);
  s.moves(box_mesh(Vec3(0.05)), {{1, 0, 0}, {1, 0, 0, 0}}, 1e4);
  try {
    s.scene();
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("ratio of at most 1e6"), std::string::npos);
  }
}

/// A damped cube is pushed along beside another one that nothing touches, named before or after it.
TEST(MovingScene, NeighbourOfPressedBodyTakesNoForceAway) {
  for (const double speed : {0.1, 1.0}) {  // m/s; the faster one takes steps within a tick
    std::array<std::vector<double>, 2> forces;
    for (const std::size_t order : {0U, 1U}) {
      BodyScene s;
      s.damping = 1;
      for (const std::size_t i : {order, 1 - order}) {
        const double y = i == 0 ? 0 : 0.0505;
        s.moves(box_mesh(Vec3(0.05)), {{-0.025, y, 0}, {1, 0, 0, 0}}, 0.2);
      }
      const Scene scene = s.scene();
      RenderState state = scene.initial_state();
      for (int i = 0; i < 20; ++i) {
        const LineProbe probe = pointing({0.0005 - speed * 1e-3 * i, 0, 0});
        forces[order].push_back(ray_renderer().tick(scene, state, probe, i > 0 ? 1e-3 : 0).force.x);
      }
    }
    EXPECT_GT(forces[0].back(), 0.1) << speed;
    for (std::size_t i = 0; i < forces[0].size(); ++i)
      EXPECT_NEAR(forces[0][i], forces[1][i], 1e-9) << speed << " " << i;
  }
}

TEST(MovingScene, ACopiedStateContinuesTheSame) {
  BodyScene s;
  s.gravity = {0, 0, -9.81};
  s.stands(box_mesh({1, 1, 0.1}), {{0, 0, -0.05}, {1, 0, 0, 0}});
  s.moves(box_mesh(Vec3(0.05)), {{0, 0, 0.1}, {1, 0, 0, 0}}, 0.1).spin = {3, 1, 2};
  const Scene scene = s.scene();
  RenderState a = scene.initial_state();
  run(scene, a, 0.05);
  RenderState b = a;
  run(scene, a, 0.3);
  run(scene, b, 0.3);
  EXPECT_LT(glm::distance(a.motion.bodies()[0].centre, b.motion.bodies()[0].centre), 1e-6);
}

/// An L of two boxes, as parts and as a surface; rounded: as in a file of single precision.
struct Angle {
  std::vector<SceneObject> parts;
  SceneSurface surface;
};

Angle angle_of(const Quat& turn, bool rounded, int object = 0) {
  const std::vector<std::array<double, 2>> outline = {{-0.03, -0.03}, {0.03, -0.03}, {0.03, -0.01},
                                                      {-0.01, -0.01}, {-0.01, 0.03}, {-0.03, 0.03}};
  stimuli::PolygonSoup soup;
  for (const double z : {-0.02, 0.02}) {
    for (const auto& [x, y] : outline) {
      Vec3 at = turn * Vec3(x, y, z);
      if (rounded) at = Vec3(glm::vec3(at));
      soup.vertices.push_back(at);
    }
  }
  soup.faces = {{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
  for (std::uint32_t k = 0; k < 6; ++k) {
    const std::uint32_t next = (k + 1) % 6;
    soup.faces.push_back({k, next, next + 6, k + 6});
  }
  Angle out;
  stimuli::Material material;
  material.stiffness = 1000;
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, material}};
  out.surface = {std::make_shared<const stimuli::Surface>(shells), Pose{}, object};
  for (const auto& [size, middle] : {std::pair(Vec3(0.06, 0.02, 0.04), Vec3(0, -0.02, 0)),
                                     std::pair(Vec3(0.02, 0.04, 0.04), Vec3(-0.02, 0.01, 0))}) {
    SceneObject part;
    part.mesh = box_mesh(size);
    part.pose = {turn * middle, turn};
    part.material = material;
    part.object = object;
    out.parts.push_back(part);
  }
  return out;
}

MovingObject heavy(double mass, const Vec3& spin, int object = 0) {
  MovingObject moving;
  moving.object = object;
  moving.body.mass = mass;
  moving.body.spin = spin;
  return moving;
}

/// A moving concave mesh is felt by its closed surface: the same as its convex parts, where those
/// are exact.
TEST(MovingScene, ConcaveBodysSurfaceFeelsLikeItsParts) {
  const Angle angle = angle_of(Quat(1, 0, 0, 0), false);
  const std::vector<MovingObject> moving = {heavy(40, {0.1, 0.05, 0.3})};
  const Scene by_parts = moving_scene(angle.parts, moving, Vec3(0));
  const Scene by_surface = moving_scene({}, moving, Vec3(0), true, {}, true, {angle.surface});
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    RenderState a = by_parts.initial_state(), b = by_surface.initial_state();
    int touched = 0;
    for (int i = 0; i < 2400; ++i) {
      const Vec3 tip(0.03 - 2e-5 * i, 0.02 * std::sin(0.002 * i), 0.001);
      const LineProbe probe = pointing(tip);
      const Rendering p = renderer->tick(by_parts, a, probe, 1e-3);
      const Rendering q = renderer->tick(by_surface, b, probe, 1e-3);
      ASSERT_LT(glm::distance(p.force, q.force), 1e-6) << i;
      const BodyPose &pa = a.motion.bodies()[0], &pb = b.motion.bodies()[0];
      ASSERT_LT(glm::distance(pa.centre, pb.centre), 1e-9) << i;
      touched += glm::length(q.force) > 0;
    }
    EXPECT_GT(touched, 500);
  }
}

/// A tip that moves straight into a wall of a rotated body is first felt at its true depth: between
/// two ticks the stylus keeps its direction, however the body has turned.
TEST(MovingScene, FirstTouchOfTurnedBodyHasTipsDepth) {
  const Angle angle = angle_of(Quat(1, 0, 0, 0), false);
  for (const bool surface : {false, true}) {
    for (int seed = 0; seed < 6; ++seed) {
      const std::vector<MovingObject> moving = {
          heavy(1e3, {0.3 * seed, 0.5 - 0.2 * seed, 0.7 - 0.1 * seed})};
      const Scene scene = surface
                              ? moving_scene({}, moving, Vec3(0), true, {}, true, {angle.surface})
                              : moving_scene(angle.parts, moving, Vec3(0));
      RenderState state = scene.initial_state();
      bool touched = false;
      for (int i = 0; i < 1600 && !touched; ++i) {
        // In the body's frame, for its last second: towards the middle of the wall in its corner.
        const Pose& at = state.motion.bodies()[0].moved;
        const double far = 0.03 * std::max(-1.0, 1 - i / 1500.0) - 0.001;
        const Vec3 tip = at.orientation * Vec3(-0.01 + far, 0.01, 0.001) + at.position;
        const Vec3 tail = at.orientation * Vec3(0.12, 0.03, 0.01) + at.position;
        const Rendering r = ray_renderer().tick(scene, state, {tip, tail}, 1e-3);
        if (r.contacts == 0) continue;
        touched = true;
        const auto& felt = static_cast<const BodiesState&>(*state.motion.get()).felt[0];
        EXPECT_LT(felt.deepest.depth, 1e-4) << surface << seed << " " << i;
        EXPECT_GT(felt.deepest.normal.x, 1 - 1e-9) << surface << seed << " " << i;
      }
      EXPECT_TRUE(touched) << surface << seed;
    }
  }
}

/// Rounded as in a file of single precision and turning under the probe: the ideal tip is never
/// inside the body.
TEST(MovingScene, IdealTipStaysOutOfRoundedConcaveBody) {
  for (int seed = 0; seed < 12; ++seed) {
    const Quat turn = glm::normalize(Quat(1, 0.3 * seed, 0.7 - 0.2 * seed, 0.11 * seed));
    const Angle angle = angle_of(turn, true);
    const std::vector<MovingObject> moving = {
        heavy(100, {1.5 - 0.2 * seed, 0.4 * seed - 2, 1 + 0.1 * seed})};
    const stimuli::Surface& surface = *angle.surface.surface;
    for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
      const Scene scene = moving_scene({}, moving, Vec3(0), true, {}, true, {angle.surface});
      const Vec3 centre = body_world_of(scene).bodies[0].placed.position;
      RenderState state = scene.initial_state();
      int touched = 0;
      for (int i = 0; i < 2000; ++i) {
        const double phase = 0.003 * i;
        const double far = 0.024 + 0.03 * std::max(0.0, 1 - i / 400.0);
        const Vec3 tip = far * Vec3(std::cos(phase), std::sin(phase), 0.3 * std::sin(3 * phase));
        const Rendering r =
            renderer->tick(scene, state, {tip, tip + 4.0 * tip + Vec3(0, 0.01, 0.02)}, 1e-3);
        ASSERT_TRUE(std::isfinite(r.force.x));
        const auto& own = static_cast<const BodiesState&>(*state.motion.get()).shapes[0].unions;
        if (!own.groups[0].touching) continue;
        ++touched;
        ASSERT_EQ(surface.winding(own.groups[0].ideal.tip + centre), 0) << seed << " " << i;
      }
      EXPECT_GT(touched, 100) << seed;
    }
  }
}

/// As by its convex parts.
TEST(MovingScene, AConcaveBodyCollidesByItsSurface) {
  const Angle angle = angle_of(Quat(1, 0, 0, 0), false);
  SceneObject floor;
  floor.mesh = box_mesh({0.4, 0.4, 0.02});
  floor.pose = {{0, 0, -0.05}, {1, 0, 0, 0}};
  floor.material.stiffness = 1000;
  floor.object = 1;
  std::vector<SceneObject> parts = angle.parts;
  parts.push_back(floor);
  const std::vector<MovingObject> moving = {heavy(0.4, {2, 1, 0})};
  const Vec3 gravity(0, 0, -9.81);
  const Scene by_parts = moving_scene(parts, moving, gravity);
  const Scene by_surface =
      moving_scene({floor}, moving, gravity, true, {}, true, {angle.surface}, {angle.surface});
  const Scene alone = moving_scene({}, moving, gravity, true, {}, true, {angle.surface});
  RenderState a = by_parts.initial_state(), b = by_surface.initial_state(),
              c = alone.initial_state();
  run(alone, c, 0.5);
  // Through several blows, until the last ones make it lie flat.
  run(by_parts, a, 0.15);
  run(by_surface, b, 0.15);
  EXPECT_LT(glm::distance(a.motion.bodies()[0].centre, b.motion.bodies()[0].centre), 1e-8);
  run(by_parts, a, 0.35);
  run(by_surface, b, 0.35);
  EXPECT_NEAR(a.motion.bodies()[0].centre.z, b.motion.bodies()[0].centre.z, 1e-8);
  EXPECT_GT(b.motion.bodies()[0].centre.z, -0.05);
  EXPECT_LT(c.motion.bodies()[0].centre.z, -1);
}

}  // namespace
}  // namespace palpate::rendering::test
