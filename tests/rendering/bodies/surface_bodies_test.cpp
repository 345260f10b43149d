// Bodies that meet by their surfaces.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/orientation.h"
#include "tests/rendering/bodies/body_fixtures.h"
#include "tests/shared/probe_paths.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::rendering::test {
namespace {

using palpate::testing::random_direction;

std::shared_ptr<const stimuli::Surface> surface_of(const stimuli::PolygonSoup& soup) {
  stimuli::Material material;
  material.stiffness = 1000;
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, material, 0}};
  return std::make_shared<const stimuli::Surface>(shells);
}

/// Collects objects one by one, then builds a scene.
class SurfaceScene {
 public:
  Vec3 gravity{0, 0, 0};

  void stands(const stimuli::PolygonSoup& soup, const Pose& pose) { add(soup, pose); }
  stimuli::Body& moves(const stimuli::PolygonSoup& soup, const Pose& pose, double mass) {
    stimuli::Body body;
    body.mass = mass;
    moving_.push_back({next_, body, pose});
    add(soup, pose);
    return moving_.back().body;
  }
  Scene scene() const {
    return moving_scene({}, moving_, gravity, true, {}, true, surfaces_, surfaces_);
  }

 private:
  void add(const stimuli::PolygonSoup& soup, const Pose& pose) {
    surfaces_.push_back({surface_of(soup), pose, next_++, {}});
  }
  std::vector<SceneSurface> surfaces_;
  std::vector<MovingObject> moving_;
  int next_ = 0;
};

/// m, how deep any two things are inside each other now.
double deepest_overlap(const Scene& scene, const RenderState& state) {
  const BodyWorld& world = body_world_of(scene);
  const BodyWorldState& now = body_state_of(state);
  double deepest = 0;
  for (const BodyPair& pair : world.pairs) {
    const BodyMotion& a = now.motion[pair.a];
    const Pose b =
        pair.obstacle ? Pose{} : Pose{now.motion[pair.b].centre, now.motion[pair.b].orientation};
    const stimuli::CollisionSurface& other =
        pair.obstacle ? *world.obstacles[pair.b].surface : *world.bodies[pair.b].surface;
    deepest = std::max(
        deepest, overlap_of(place_of(*world.bodies[pair.a].surface, {a.centre, a.orientation}),
                            place_of(other, b)));
  }
  return deepest;
}

const stimuli::PolygonSoup kFloor = stimuli::box(Vec3(1, 1, 0.02));
constexpr Pose kUnderneath{{0, 0, -0.01}, {1, 0, 0, 0}};

TEST(SurfaceBodies, FallAndComeToRest) {
  const std::vector<stimuli::PolygonSoup> shapes = {stimuli::solids::l_shape().soup,
                                                    stimuli::solids::u_shape().soup,
                                                    stimuli::solids::stair(4).soup};
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    Random random(seed);
    for (const stimuli::PolygonSoup& shape : shapes) {
      SurfaceScene objects;
      objects.gravity = {0, 0, -9.81};
      stimuli::Body& body =
          objects.moves(shape, {{0, 0, 0.12}, stimuli::uniform_rotation(random)}, 0.1);
      body.restitution = 0.3;
      body.friction = 0.4;
      objects.stands(kFloor, kUnderneath);
      const Scene scene = objects.scene();
      RenderState state = scene.initial_state();
      const auto energy = [&] {
        const BodyWorldState& now = body_state_of(state);
        return kinetic_energy(body_world_of(scene), now) + 0.1 * 9.81 * now.motion[0].centre.z;
      };
      double last = energy();
      for (int i = 0; i < 150; ++i) {
        run(scene, state, 0.01);
        const double now = energy();
        EXPECT_LT(now, last + 1e-4 * 0.1 * 9.81) << seed << ' ' << i;  // 0.1 mm of lift
        last = std::min(last, now);
        EXPECT_LT(deepest_overlap(scene, state), 1e-4) << seed << ' ' << i;
      }
      EXPECT_TRUE(body_state_of(state).sleep[0].asleep) << seed;
      EXPECT_LT(deepest_overlap(scene, state), 1e-6) << seed;
    }
  }
}

TEST(SurfaceBodies, KeepMomentumAndGainNoEnergy) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    Random random(seed);
    SurfaceScene objects;
    for (const double side : {-1.0, 1.0}) {
      stimuli::Body& body = objects.moves(
          side < 0 ? stimuli::solids::u_shape().soup : stimuli::solids::l_shape().soup,
          {Vec3(0.08 * side, 0, 0) + 0.01 * random_direction(random),
           stimuli::uniform_rotation(random)},
          side < 0 ? 0.1 : 0.3);
      body.velocity = Vec3(-0.5 * side, 0, 0) + 0.02 * random_direction(random);
      body.spin = 5.0 * random_direction(random);
      body.restitution = 1;
      body.friction = 0;
    }
    const Scene scene = objects.scene();
    RenderState state = scene.initial_state();
    const BodyWorld& world = body_world_of(scene);
    const BodyWorldState& now = body_state_of(state);
    const Vec3 push = momentum(world, now), turn = angular_momentum(world, now);
    const double energy = kinetic_energy(world, now);
    const Vec3 first = now.motion[0].velocity;
    for (int i = 0; i < 50; ++i) {
      run(scene, state, 0.01);
      EXPECT_LT(kinetic_energy(world, now), energy * (1 + 1e-6)) << seed << ' ' << i;
      EXPECT_LT(deepest_overlap(scene, state), 1e-4) << seed << ' ' << i;
    }
    EXPECT_GT(glm::distance(now.motion[0].velocity, first), 0.05) << seed;  // they have met
    EXPECT_LT(glm::distance(momentum(world, now), push), 1e-12);
    EXPECT_LT(glm::distance(angular_momentum(world, now), turn), 1e-9);
  }
}

TEST(SurfaceBodies, HeadOnImpactChangesPlaces) {
  SurfaceScene objects;
  // Their flat outer walls meet, middle on middle.
  const stimuli::PolygonSoup shape = stimuli::solids::u_shape().soup;
  stimuli::Body& first = objects.moves(shape, {{-0.1, 0, 0}, {1, 0, 0, 0}}, 0.2);
  first.velocity = {0.5, 0, 0};
  first.restitution = 1;
  stimuli::Body& second = objects.moves(shape, {{0, 0, 0}, {1, 0, 0, 0}}, 0.2);
  second.restitution = 1;
  const Scene scene = objects.scene();
  RenderState state = scene.initial_state();
  run(scene, state, 0.3);
  const BodyWorldState& now = body_state_of(state);
  EXPECT_LT(glm::length(now.motion[0].velocity), 1e-6);
  EXPECT_LT(glm::distance(now.motion[1].velocity, Vec3(0.5, 0, 0)), 1e-6);
}

TEST(SurfaceBodies, PegStaysInItsNotch) {
  SurfaceScene objects;
  objects.gravity = {0, 0, -9.81};
  // A u stands on its back; a bar lies across in its notch of 20 mm.
  const Quat upright = glm::angleAxis(std::acos(0.0), Vec3(1, 0, 0));
  objects.stands(stimuli::solids::u_shape().soup, {{-0.03, 0.015, 0}, upright});
  stimuli::Body& bar =
      objects.moves(stimuli::box(Vec3(0.0199, 0.1, 0.01)), {{0, 0, 0.04}, {1, 0, 0, 0}}, 0.05);
  bar.friction = 0;
  bar.velocity = {0.2, 0, 0};
  const Scene scene = objects.scene();
  RenderState state = scene.initial_state();
  for (int i = 0; i < 1000; ++i) {
    run(scene, state, 0.001);
    ASSERT_LT(deepest_overlap(scene, state), 1e-7) << i;
  }
  const BodyMotion& now = body_state_of(state).motion[0];
  EXPECT_NEAR(now.centre.z, 0.025, 1e-6);
  EXPECT_LT(std::abs(now.centre.x), 1e-4);
}

}  // namespace
}  // namespace palpate::rendering::test
