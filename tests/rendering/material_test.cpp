// Material forces beyond plain springs: damping and friction.

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
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::kTick;

constexpr double kTop = 0.05;     // m, of the cube's upper face
constexpr double kLength = 0.12;  // m, of the stylus

/// A cube of 0.1 m felt from above.
class Block {
 public:
  explicit Block(const stimuli::Material& material, const Renderer& renderer = point_renderer())
      : renderer_(renderer), scene_({object(material)}), state_(scene_.initial_state()) {
    tick(-0.01);
  }

  static SceneObject object(const stimuli::Material& material) {
    auto object = testing::placed_object(
        std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(2 * kTop)));
    object.material = material;
    return object;
  }

  /// The stylus upright, its tip `depth` below the upper face.
  Rendering tick(double depth, double x = 0, double y = 0) {
    const Vec3 tip(x, y, kTop - depth);
    return renderer_.tick(scene_, state_, {tip, tip + Vec3(0, 0, kLength)}, kTick);
  }

 private:
  const Renderer& renderer_;
  Scene scene_;
  RenderState state_;
};

stimuli::Material frictional(double fixed, double dynamic) {
  stimuli::Material material;
  material.friction_static = fixed;
  material.friction_dynamic = dynamic;
  return material;
}

TEST(Material, DampingResistsTheWayInAndNeverPulls) {
  stimuli::Material material;
  material.damping = 2;
  Block block(material);
  block.tick(0.001);
  const double in = block.tick(0.0012).force.z;
  EXPECT_NEAR(in, 800 * 0.0012 + 2 * 0.2, 1e-9);
  EXPECT_NEAR(block.tick(0.0012).force.z, 800 * 0.0012, 1e-9);
  EXPECT_EQ(block.tick(0.0004).force.z, 0);  // 0.8 m/s out: 0.32 N of spring, 1.6 N of damping
}

TEST(Friction, SticksBelowStaticAndSlidesAtDynamicCoefficient) {
  Block block(frictional(0.5, 0.3));
  const double depth = 0.002, normal = 800 * depth;
  block.tick(depth);
  // Sticking: a spring of 800 N/m along the surface, up to 0.5 of the normal force.
  Rendering r = block.tick(depth, 0.0004);
  EXPECT_NEAR(r.force.x, -800 * 0.0004, 1e-9);
  EXPECT_NEAR(r.force.z, normal, 1e-9);
  EXPECT_NEAR(r.deepest.point.x, 0, 1e-12);  // the ideal probe stays where it is
  EXPECT_NEAR(r.ideal.tip.x, 0, 1e-12);
  r = block.tick(depth, 0.00099);
  EXPECT_NEAR(r.force.x, -800 * 0.00099, 1e-9);
  // Past 1 mm it slides.
  for (int i = 1; i < 20; ++i) {
    r = block.tick(depth, 0.001 + 1e-4 * i);
    EXPECT_NEAR(r.force.x, -0.3 * normal, 1e-9) << i;
  }
  // After a reversal it sticks until the spring is stretched the other way.
  r = block.tick(depth, 0.0029 - 0.0006);
  EXPECT_NEAR(r.force.x, 0, 1e-9);
  r = block.tick(depth, 0.0023 - 0.0009);
  EXPECT_NEAR(r.force.x, 800 * 0.0009, 1e-9);
  r = block.tick(depth, 0.001);
  EXPECT_NEAR(r.force.x, 0.3 * normal, 1e-9);
}

TEST(Friction, IsIsotropicAndLiesInTheSurface) {
  Block block(frictional(0.4, 0.4));
  Rendering r = block.tick(0.001);
  for (int i = 0; i < 400; ++i) {
    const double angle = 0.05 * i;
    r = block.tick(0.001, 0.01 * std::cos(angle), 0.01 * std::sin(angle));
  }
  const Vec3 along(-std::sin(0.05 * 399), std::cos(0.05 * 399), 0);
  EXPECT_NEAR(std::hypot(r.force.x, r.force.y), 0.4 * 0.8, 1e-9);
  EXPECT_GT(glm::dot(-r.force, along), 0.99 * 0.4 * 0.8);
  EXPECT_NEAR(r.force.z, 0.8, 1e-9);
}

TEST(Friction, EndsWithTheContact) {
  Block block(frictional(0.5, 0.5));
  block.tick(0.002);
  EXPECT_LT(block.tick(0.002, 0.0005).force.x, -0.3);
  block.tick(-0.001, 0.0005);
  EXPECT_EQ(block.tick(0.002, 0.0005).force.x, 0);
}

TEST(Friction, SideFrictionTurnsTheStylus) {
  Scene scene({Block::object(frictional(0.5, 0.5))});
  RenderState state = scene.initial_state();
  const auto held = [](double depth, double y) {
    const Vec3 axis = glm::normalize(Vec3(1, 0, -1));  // leans on the edge at 45 degrees
    const Vec3 tip = Vec3(kTop, y, kTop) - 0.03 * axis - depth * glm::normalize(Vec3(1, 0, 1));
    return LineProbe{tip, tip + kLength * axis};
  };
  ray_renderer().tick(scene, state, held(-0.005, 0), kTick);
  Rendering r = ray_renderer().tick(scene, state, held(0.001, 0), kTick);
  ASSERT_EQ(r.deepest.type, ContactType::segment_edge);
  EXPECT_NEAR(glm::length(r.force), 0.8, 1e-9);
  r = ray_renderer().tick(scene, state, held(0.001, 0.0002), kTick);
  EXPECT_NEAR(r.force.y, -800 * 0.0002, 1e-9);
  // Moment about the tip: the friction acts at the contact, 30 mm up the stylus.
  const Vec3 expected = glm::cross(r.deepest.point - held(0.001, 0.0002).tip, r.force);
  EXPECT_LT(glm::length(r.torque - expected), 1e-12);
  EXPECT_NEAR(glm::length(r.device1 + r.device2 - r.force), 0, 1e-12);
  EXPECT_NEAR(r.device2.y, 0.25 * r.force.y, 1e-9);
}

TEST(Friction, NeverGivesEnergyOnClosedPathsOnFaces) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  const auto between = [&](double low, double high) { return low + (high - low) * random.unit(); };
  for (int round = 0; round < 50; ++round) {
    stimuli::Material material = frictional(between(0.1, 1), 0);
    material.friction_dynamic = material.friction_static * between(0, 1);
    if (round % 2 == 0) material.damping = between(0, 3);
    Block block(material);
    const double a = between(0.0002, 0.003), b = between(0.0002, 0.003);
    const double c = between(0, 0.0008), phase = between(0, 6);
    constexpr int kTicks = 2000;
    double work = 0;  // done on the hand, J; the force at the middle of a step is the mean
    Vec3 last_force(0), last(0);
    for (int i = 0; i <= 3 * kTicks; ++i) {
      const double turn = 2 * std::numbers::pi * i / kTicks;
      const Vec3 at(a * std::cos(turn), b * std::sin(2 * turn + phase),
                    kTop - 0.001 + c * std::sin(3 * turn));
      const Rendering r = block.tick(kTop - at.z, at.x, at.y);
      ASSERT_GT(r.contacts, 0);
      // The first lap stretches the spring.
      if (i > kTicks) work += glm::dot(0.5 * (r.force + last_force), at - last);
      last_force = r.force;
      last = at;
    }
    EXPECT_LT(work, 0) << round;
  }
}

TEST(Friction, ContinuesOverASeam) {
  // Two halves of a block side by side: felt as one.
  std::vector<SceneObject> halves;
  for (const double x : {-kTop, kTop}) {
    auto half = Block::object(frictional(0.3, 0.3));
    half.pose.position.x = x;
    halves.push_back(std::move(half));
  }
  const Scene scene(std::move(halves));
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    RenderState state = scene.initial_state();
    const auto tick = [&](double x, double depth) {
      const Vec3 tip(x, 0, kTop - depth);
      return renderer->tick(scene, state, {tip, tip + Vec3(0, 0, kLength)}, kTick);
    };
    tick(-0.02, -0.01);
    for (int i = 0; i < 400; ++i) {
      const Rendering r = tick(-0.02 + 1e-4 * i, 0.001);
      if (i > 10) {
        EXPECT_NEAR(r.force.x, -0.3 * 0.8, 1e-9) << renderer->name() << i;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::rendering
