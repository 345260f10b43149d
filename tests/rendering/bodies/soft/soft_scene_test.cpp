// Soft objects in scenes.

#include "rendering/bodies/soft/soft_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "rendering/bodies/soft/soft_build.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/renderer.h"
#include "runner/evidence/tick_meters.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

stimuli::ObjectSpec soft_cube(double young) {
  stimuli::ObjectSpec spec;
  spec.shape = stimuli::ShapeKind::cube;
  spec.edge = 0.05;
  spec.soft = stimuli::Soft{.young = young, .points = {}, .resolution = 4};
  return spec;
}

SceneObject rigid_cube(const Vec3& at) {
  SceneObject object;
  object.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.05));
  object.pose.position = at;
  object.object = 1;
  return object;
}

/// A soft cube at the origin, a rigid one beside it.
Scene two_cubes(bool sides, const Tool& tool = {}, double young = 20000) {
  Scene others({rigid_cube({0.1, 0, 0})}, sides, tool);
  return soft_scene(std::move(others), {rigid_cube({0.1, 0, 0})},
                    {build_soft_object(soft_cube(young), Pose{}, {})}, sides, tool);
}

LineProbe standing(double x, double z) { return {{x, 0.001, z}, {x, 0.001, z + 0.12}}; }

Rendering press(const Renderer& renderer, const Scene& scene, RenderState& state, double x,
                double depth) {
  Rendering result;
  for (int i = 0; i <= 600; ++i) {
    const double sunk = std::min(depth, 2e-5 * i - 0.002);
    result = renderer.tick(scene, state, standing(x, 0.027 - sunk), i > 0 ? 0.001 : 0);
  }
  return result;
}

TEST(SoftScene, PointAndUprightRayFeelTheSameForce) {
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    const Scene scene = two_cubes(renderer->side_contact());
    RenderState state = scene.initial_state();
    const Rendering r = press(*renderer, scene, state, 0.002, 0.004);
    EXPECT_GT(r.force.z, 0.2);
    EXPECT_EQ(r.object, 0);
    EXPECT_GT(r.contacts, 0);
    EXPECT_EQ(r.faults, 0U);
    EXPECT_LT(glm::length(r.force - 800 * r.deepest.depth * r.deepest.normal), 1e-9);
    EXPECT_LT(glm::length(r.device1 + r.device2 - r.force), 1e-12);
    // Torque about the tip equals the moment of the device forces about it, except torsion.
    const Vec3 axis(0, 0, 1), moment = glm::cross(0.12 * axis, r.device2);
    EXPECT_LT(glm::length(moment - (r.torque - glm::dot(r.torque, axis) * axis)), 1e-12);
  }
}

TEST(SoftScene, AStifferBodyPushesMore) {
  double last = 0;
  for (const double young : {2e3, 2e4, 2e5, 2e6}) {
    const Scene scene = two_cubes(true, {}, young);
    RenderState state = scene.initial_state();
    const double force = press(ray_renderer(), scene, state, 0.002, 0.004).force.z;
    EXPECT_GT(force, 1.2 * last);
    EXPECT_LT(force, 800 * 0.004);
    last = force;
  }
}

TEST(SoftScene, RigidObjectsBesideItAreRenderedAsEver) {
  const Scene mixed = two_cubes(true), alone({rigid_cube({0.1, 0, 0})}, true);
  RenderState a = mixed.initial_state(), b = alone.initial_state();
  for (int i = 0; i < 300; ++i) {
    const LineProbe probe = standing(0.1, 0.026 - 1e-5 * i);
    const Rendering r = ray_renderer().tick(mixed, a, probe, 0.001);
    const Rendering s = ray_renderer().tick(alone, b, probe, 0.001);
    EXPECT_EQ(r.force, s.force);
    EXPECT_EQ(r.torque, s.torque);
    EXPECT_EQ(r.object, s.object);
  }
}

TEST(SoftScene, LongTicksAreCutInPieces) {
  const Scene scene = two_cubes(true);
  RenderState fine = scene.initial_state(), coarse = scene.initial_state();
  Rendering at_1_khz, at_100_hz;
  for (int i = 0; i <= 300; ++i) {
    const LineProbe probe = standing(0.002, 0.028 - 2e-5 * i);
    at_1_khz = ray_renderer().tick(scene, fine, probe, i > 0 ? 0.001 : 0);
    if (i % 10 == 0) at_100_hz = ray_renderer().tick(scene, coarse, probe, i > 0 ? 0.01 : 0);
  }
  EXPECT_GT(at_1_khz.force.z, 0.1);
  EXPECT_NEAR(at_100_hz.force.z / at_1_khz.force.z, 1, 1e-6);
}

TEST(SoftScene, FallsEquallyFarInLongAndShortTicks) {
  stimuli::ObjectSpec spec = soft_cube(20000);
  spec.soft->resolution = 2;
  spec.soft->fixed = stimuli::Soft::Fixed::none;
  const Scene scene = soft_scene(
      Scene({}, true), {}, {build_soft_object(spec, Pose{}, {0.002, {0, 0, -1}, 0})}, true, {});
  const auto fallen = [&](double dt) {
    RenderState state = scene.initial_state();
    const int ticks = static_cast<int>(std::lround(2 / dt));
    for (int i = 0; i <= ticks; ++i)
      ray_renderer().tick(scene, state, standing(1, 1), i > 0 ? dt : 0);
    return -soft_shapes(scene, state)[0].now[0].z;
  };
  const double fine = fallen(0.001);
  EXPECT_NEAR(fine, 2, 0.04);
  EXPECT_NEAR(fallen(0.2), fine, 0.02);
  EXPECT_NEAR(fallen(1), fine, 0.02);
}

TEST(SoftScene, DefaultsToTheHighestSteppableResolution) {
  stimuli::ObjectSpec plain = soft_cube(20000);
  plain.soft->resolution = 0;
  const auto found = build_soft_object(plain, Pose{}, {});
  EXPECT_GE(found->body->mesh().hexahedra.size(), 216U);
  EXPECT_LE(found->body->mesh().hexahedra.size(), 1000U);
  EXPECT_TRUE(coupling_is_stable({.young = 20000}, 1 / found->body->settings().step));
}

TEST(SoftScene, ABallIsHeldAgainstTurningHoweverCoarse) {
  for (const int resolution : {2, 3, 4, 5, 8}) {
    stimuli::ObjectSpec spec = soft_cube(20000);
    spec.shape = stimuli::ShapeKind::sphere;
    spec.radius = 0.03;
    spec.soft->resolution = resolution;
    const auto ball = build_soft_object(spec, Pose{}, {});
    const SoftBody& body = *ball->body;
    SoftState state = body.rest();
    std::uint32_t top = 0;
    for (std::uint32_t i = 0; i < body.surface_nodes().size(); ++i) {
      if (ball->rest[i].z > ball->rest[top].z) top = i;
    }
    const std::vector<NodeForce> aside{{top, {0.05, 0.03, 0}}};  // N
    const auto seconds = [&](double s) { return static_cast<int>(s / body.settings().step); };
    for (int i = 0; i < seconds(1); ++i) body.step(state, aside);
    const std::uint32_t node = body.surface_nodes()[top];
    EXPECT_GT(state.x[node].x, ball->rest[top].x + 1e-4) << resolution;
    for (int i = 0; i < seconds(6); ++i) body.step(state, {});
    double most = 0;
    for (std::size_t i = 0; i < state.x.size(); ++i)
      most = std::max(most, glm::distance(state.x[i], body.mesh().nodes[i]));
    EXPECT_LT(most, 1e-6) << resolution;
  }
}

TEST(SoftScene, FixedPointsAreOnTheObject) {
  stimuli::ObjectSpec spec = soft_cube(20000);
  spec.soft->fixed = stimuli::Soft::Fixed::points;
  spec.soft->points = {{0.025, 0.025, -0.025}, {25, 25, 25}};  // the second in mm
  try {
    build_soft_object(spec, Pose{}, {});
    FAIL() << "was taken";
  } catch (const stimuli::MeshError& error) {
    ASSERT_EQ(error.faults().size(), 1U);
    EXPECT_EQ(error.faults()[0].rfind("/soft/fixed/1: ", 0), 0U) << error.faults()[0];
  }
}

TEST(SoftScene, CopiedStatesContinueNaNGivesNoForce) {
  const Scene scene = two_cubes(true);
  RenderState state = scene.initial_state();
  press(ray_renderer(), scene, state, 0.002, 0.003);
  RenderState copy = state;
  for (int i = 0; i < 20; ++i) {
    const LineProbe probe = standing(0.002 + 1e-4 * i, 0.024);
    EXPECT_EQ(ray_renderer().tick(scene, state, probe, 0.001).force,
              ray_renderer().tick(scene, copy, probe, 0.001).force);
  }
  const Rendering none = ray_renderer().tick(scene, state, standing(NAN, 0), 0.001);
  EXPECT_EQ(none.force, Vec3(0));
  EXPECT_EQ(none.faults, render_fault::kNonFinite);
  EXPECT_GT(ray_renderer().tick(scene, state, standing(0.004, 0.024), 0.001).force.z, 0);
}

TEST(SoftScene, ShapesToBeDrawnMoveUnderTheTool) {
  const Scene scene = two_cubes(true);
  RenderState state = scene.initial_state();
  press(ray_renderer(), scene, state, 0.002, 0.004);
  const std::vector<SoftShape> shapes = soft_shapes(scene, state);
  ASSERT_EQ(shapes.size(), 1U);
  double most = 0;
  for (std::size_t i = 0; i < shapes[0].now.size(); ++i)
    most = std::max(most, glm::distance(shapes[0].rest[i], shapes[0].now[i]));
  EXPECT_GT(most, 0.001);
  EXPECT_LT(most, 0.005);
  EXPECT_TRUE(
      soft_shapes(Scene({rigid_cube(Vec3(0))}), Scene({rigid_cube(Vec3(0))}).initial_state())
          .empty());
}

/// A stepper elsewhere: steps are requested and taken there, and every view comes from there.
class CountingStepper final : public SoftStepper {
 public:
  void ask(std::span<const NodeForce> forces) noexcept override {
    ++asked;
    forced += forces.empty() ? 0 : 1;
  }
  bool ready() const noexcept override { return asked > 0; }
  bool take(SoftView& view) noexcept override {
    ++taken;
    for (Vec3& x : view.x) x.z -= 1e-6;
    return true;
  }
  int asked = 0, forced = 0, taken = 0;
};

TEST(SoftScene, StepsAreMadeByTheGivenStepper) {
  stimuli::ObjectSpec spec = soft_cube(20000);
  Pose aside;
  aside.position.y = 0.2;
  const Scene scene = soft_scene(
      Scene({}, true), {},
      {build_soft_object(spec, Pose{}, {}), build_soft_object(spec, aside, {})}, true, {});
  RenderState state = scene.initial_state();
  CountingStepper first, second;
  SoftStepper* const steppers[] = {&first, &second};
  step_elsewhere(state, steppers);
  const double before = soft_shapes(scene, state)[0].now[0].z;
  press(ray_renderer(), scene, state, 0.002, 0.004);
  for (const CountingStepper* one : {&first, &second}) {
    EXPECT_GT(one->asked, 10);
    EXPECT_LE(std::abs(one->asked - one->taken), 1);
  }
  EXPECT_GT(first.forced, 10);  // under the tool
  EXPECT_EQ(second.forced, 0);
  EXPECT_NEAR(before - soft_shapes(scene, state)[0].now[0].z, 1e-6 * first.taken, 1e-12);
}

TEST(SoftScene, BodiesThatCannotBeSteppedAreRefused) {
  stimuli::ObjectSpec fine = soft_cube(20000);
  fine.soft->resolution = 18;
  EXPECT_THROW(build_soft_object(fine, Pose{}, {}), stimuli::MeshError);
  stimuli::ObjectSpec held = soft_cube(20000);
  held.soft->resolution = 2;
  held.soft->fixed = stimuli::Soft::Fixed::points;
  for (const Vec3& p : stimuli::mesh_of_primitive(held, 2).nodes) held.soft->points.push_back(p);
  EXPECT_THROW(build_soft_object(held, Pose{}, {}), stimuli::MeshError);
}

TEST(SoftScene, TicksOfSeveralOrACopyNeverAllocate) {
  Pose beside;
  beside.position.x = 0.06;
  const Scene scene = soft_scene(Scene({}, true), {},
                                 {build_soft_object(soft_cube(20000), Pose{}, {}),
                                  build_soft_object(soft_cube(9000), beside, {.object = 1})},
                                 true, {});
  RenderState state = scene.initial_state();
  RenderState copy = state;
  for (RenderState* const touched : {&state, &copy}) {
    for (const double x : {0.002, 0.062}) {
      const std::uint64_t before = runner::evidence::allocations();
      const Rendering r = press(ray_renderer(), scene, *touched, x, 0.004);
      EXPECT_EQ(runner::evidence::allocations(), before) << x;
      EXPECT_GT(r.force.z, 0.1) << x;
    }
  }
}

}  // namespace
}  // namespace palpate::rendering
