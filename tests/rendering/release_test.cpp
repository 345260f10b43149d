// Layers under a surface, layers that break, and hooks (rendering/union_contact.h).

#include <gtest/gtest.h>

#include <glm/common.hpp>

#include "rendering/union_contact.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/union_scenes.h"

namespace palpate::rendering {
namespace {

using testing::box;
using testing::box_soup;
using testing::kTick;

constexpr double kHalfEdge = 0.03;  // m, of a cube

/// A cube and the same cube moved inwards by each layer's depth.
std::vector<SceneObject> layered_cube(double surface, const std::vector<stimuli::Layer>& layers,
                                      bool in_two_parts) {
  std::vector<SceneObject> parts;
  const auto add = [&](int layer, double depth, double stiffness, double damping,
                       std::optional<double> breaks) {
    const double half = kHalfEdge - depth;
    std::vector<stimuli::PolygonSoup> solids{box_soup(Vec3(-half), Vec3(half))};
    if (in_two_parts) solids = testing::cut_in_two(solids[0], Vec3(1, 0, 0), Vec3(0.001, 0, 0));
    for (const auto& solid : solids) {
      SceneObject part = testing::placed_object(testing::mesh_of(solid), {}, stiffness, 0);
      part.layer = layer;
      part.material.damping = damping;
      if (breaks) part.break_force = *breaks;
      parts.push_back(part);
    }
  };
  add(0, 0, surface, 0, std::nullopt);
  for (std::size_t i = 0; i < layers.size(); ++i)
    add(static_cast<int>(i) + 1, layers[i].depth, layers[i].stiffness, layers[i].damping,
        layers[i].break_force);
  return parts;
}

LineProbe at_depth(double depth) {
  return {{0.004, 0.003, kHalfEdge - depth}, {0.004, 0.003, kHalfEdge - depth + 0.1}};
}

class Layers : public ::testing::TestWithParam<bool> {};

TEST_P(Layers, EachAddsItsSpringFromItsDepthOn) {
  const std::vector<stimuli::Layer> layers{{0.001, 1000, 0, {}}, {0.002, 50, 0, {}}};
  for (const double surface : {200.0, 0.0}) {
    const Scene scene(layered_cube(surface, layers, GetParam()));
    for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
      RenderState state = scene.initial_state();
      renderer->tick(scene, state, at_depth(-0.01), kTick);
      for (double depth = 0; depth < 0.006; depth += 1e-4) {
        const Rendering r = renderer->tick(scene, state, at_depth(depth), kTick);
        double force = surface * depth;
        for (const stimuli::Layer& layer : layers)
          force += layer.stiffness * std::max(0.0, depth - layer.depth);
        EXPECT_LE(glm::length(r.force - Vec3(0, 0, force)), 1e-9) << depth;
        EXPECT_LE(glm::length(r.device1 + r.device2 - r.force), 1e-12);
        if (depth > 1e-6) {
          EXPECT_EQ(r.object, 0);
        }
      }
    }
  }
}

TEST_P(Layers, LayerDampingActsInsideTheLayer) {
  const Scene scene(layered_cube(100, {{0.001, 500, 4, {}}}, GetParam()));
  RenderState state = scene.initial_state();
  ray_renderer().tick(scene, state, at_depth(-0.001), kTick);
  ray_renderer().tick(scene, state, at_depth(0.0005), kTick);
  EXPECT_NEAR(ray_renderer().tick(scene, state, at_depth(0.0006), kTick).force.z, 0.06, 1e-9);
  ray_renderer().tick(scene, state, at_depth(0.002), kTick);
  const double in = ray_renderer().tick(scene, state, at_depth(0.0021), kTick).force.z;
  EXPECT_NEAR(in, 100 * 0.0021 + 500 * 0.0011 + 4 * 0.1, 1e-9);
}

TEST_P(Layers, BrokenLayerFadesAndReturnsOnceLeft) {
  constexpr double kBreaks = 1;  // N: 2 mm into the layer
  const Scene scene(layered_cube(100, {{0.001, 500, 0, kBreaks}}, GetParam()));
  RenderState state = scene.initial_state();
  const auto tick = [&](double depth) {
    return ray_renderer().tick(scene, state, at_depth(depth), kTick).force.z;
  };
  for (int round = 0; round < 2; ++round) {
    tick(-0.005);
    double last = 0, depth = 0;
    for (; depth < 0.00299; depth += 1e-5) {
      last = tick(depth);
      ASSERT_NEAR(last, 100 * depth + 500 * std::max(0.0, depth - 0.001), 1e-9);
    }
    depth = 0.0031;
    int ticks = 0;
    for (; ticks < 60; ++ticks) {
      const double force = tick(depth);
      ASSERT_LE(std::abs(force - last), 0.06 + 1e-9)
          << ticks;  // 1.05 N in 20 ticks, and the step in depth
      last = force;
      if (std::abs(force - 100 * depth) < 1e-9) break;
    }
    EXPECT_GE(ticks * kTick, kFadeTime - 2 * kTick);
    EXPECT_LE(ticks * kTick, kFadeTime + kTick);
    // Out of the layer and in again, but not out of the object: still broken.
    for (const double again : {0.002, 0.0005, 0.002, 0.004})
      EXPECT_NEAR(tick(again), 100 * again, 1e-9);
    EXPECT_EQ(tick(-0.001), 0);
    EXPECT_NEAR(tick(0.002), 100 * 0.002 + 500 * 0.001, 1e-9);
  }
}

TEST_P(Layers, ABrokenLayerHoldsNothing) {
  std::vector<SceneObject> parts = layered_cube(0, {{0.001, 500, 0, 1.0}}, GetParam());
  for (SceneObject& part : parts) {
    if (part.layer == 0) part.layer = kNotFelt;
  }
  const Scene scene(parts);
  RenderState state = scene.initial_state();
  for (double depth = -0.002; depth < 0.004; depth += 1e-5)
    ray_renderer().tick(scene, state, at_depth(depth), kTick);
  Rendering r;
  for (int i = 0; i < 25; ++i) r = ray_renderer().tick(scene, state, at_depth(0.004), kTick);
  EXPECT_EQ(r.contacts, 0);
  EXPECT_EQ(r.force, Vec3(0));
  EXPECT_EQ(r.ideal.tip, at_depth(0.004).tip);
  // Right through the cube, out below and back in from there: the layer is whole.
  for (double depth = 0.004; depth < 0.0601; depth += 1e-4)
    EXPECT_EQ(ray_renderer().tick(scene, state, at_depth(depth), kTick).contacts, 0) << depth;
  for (double depth = -0.11; depth > -0.102; depth -= 1e-4)
    r = ray_renderer().tick(scene, state, at_depth(depth), kTick);
  for (double depth = -0.002; depth < 0.0015; depth += 1e-5)
    r = ray_renderer().tick(scene, state, at_depth(depth), kTick);
  EXPECT_NEAR(r.force.z, 500 * 0.0005, 6e-3);
}

/// A floor and a wall on its left, side by side, with a layer 1 mm deep that breaks at 0.1 N or
/// none.
std::vector<SceneObject> corner(bool has_layer) {
  std::vector<SceneObject> parts;
  const auto add = [&](const Vec3& low, const Vec3& high) {
    const auto surface = testing::mesh_of(box_soup(low, high));
    parts.push_back(testing::placed_object(surface, {}, 800, 0));
    if (!has_layer) return;
    const auto layer = testing::mesh_of(box_soup(low + Vec3(0.001), high - Vec3(0.001)));
    parts.push_back(testing::placed_object(layer, {}, 500, 0));
    parts.back().layer = 1;
    parts.back().break_force = 0.1;
  };
  add({0, -0.03, -0.015}, {0.03, 0.03, 0});
  add({-0.015, -0.03, -0.015}, {0, 0.03, 0.03});
  return parts;
}

TEST(PartsOfALayer, BrokenOneDoesNotMoveSurfacesIdealTool) {
  const Scene surface(corner(false)), layered(corner(true));
  RenderState alone = surface.initial_state(), beside = layered.initial_state();
  const auto difference = [&](const Vec3& tip, const Vec3& d) {
    const LineProbe probe{tip, tip + d};
    const Rendering expected = ray_renderer().tick(surface, alone, probe, kTick);
    const Rendering found = ray_renderer().tick(layered, beside, probe, kTick);
    return glm::length(found.force - expected.force);
  };
  const Vec3 above(0.015, 0.023, 0.01), deep(0.015, 0.023, -0.008), end(-0.013, 0.027, -0.02);
  const Vec3 d(-0.02, 0.07, 0.05), last_d(-0.02, 0.04, 0.07);
  for (int i = 0; i < 50; ++i) difference(glm::mix(above, deep, i / 50.0), d);
  for (int i = 0; i < 25; ++i) difference(deep, d);  // the layer's force fades
  for (int i = 0; i <= 100; ++i)
    ASSERT_LE(difference(glm::mix(deep, end, i / 100.0), glm::mix(d, last_d, i / 100.0)), 1e-9)
        << i;
}

/// A slab that breaks at 1 N on a block that does not break, both of one layer.
TEST(PartsOfALayer, PartUnderBrokenOneTakesOverSmoothly) {
  constexpr double kTop = 0.03, kSeam = 0.026, kSpring = 500;  // m, m, N/m
  std::vector<SceneObject> parts{
      testing::placed_object(testing::mesh_of(box_soup(Vec3(-kTop), Vec3(kTop))), {}, 0, 0),
      testing::placed_object(
          testing::mesh_of(box_soup(Vec3(-0.02, -0.02, kSeam), Vec3(0.02, 0.02, kTop))), {},
          kSpring, 0),
      testing::placed_object(
          testing::mesh_of(box_soup(Vec3(-0.02, -0.02, -0.02), Vec3(0.02, 0.02, kSeam))), {},
          kSpring, 0)};
  parts[0].layer = kNotFelt;
  parts[1].layer = parts[2].layer = 1;
  parts[1].break_force = 1;
  for (const bool turned_round : {false, true}) {
    if (turned_round) std::swap(parts[1], parts[2]);
    const Scene scene(parts);
    RenderState state = scene.initial_state();
    double depth = -0.001, last = 0;
    const auto tick = [&] {
      const Rendering r = ray_renderer().tick(scene, state, at_depth(depth), kTick);
      EXPECT_LE(std::abs(r.force.z - last), 0.35) << depth;  // fade of 5 N in 20 ms, motion
      last = r.force.z;
      return r;
    };
    // Fast enough to be 10 mm inside the block when the slab is gone.
    for (; depth < 0.014; depth += 6e-4) tick();
    for (int i = 0; i < 60; ++i) tick();
    EXPECT_NEAR(last, kSpring * (depth - (kTop - kSeam)), 1e-9);
    // The block holds it from above although the ideal tool is at the slab's former place.
    for (; depth > 0.001; depth -= 1e-4) tick();
    EXPECT_EQ(tick().contacts, 0);
    for (; depth > -0.002; depth -= 1e-4) tick();
    for (; depth < 0.001; depth += 1e-5) tick();
    EXPECT_NEAR(last, kSpring * (depth - 1e-5), 1e-9) << "whole again";
  }
}

TEST_P(Layers, StartBetweenSurfaceAndLayerGivesNoForce) {
  const Scene scene(layered_cube(100, {{0.005, 500, 0, {}}}, GetParam()));
  RenderState state = scene.initial_state();
  for (const double depth : {0.002, 0.006, 0.008, 0.001}) {
    const Rendering r = ray_renderer().tick(scene, state, at_depth(depth), kTick);
    EXPECT_EQ(r.force, Vec3(0));
    EXPECT_EQ(r.faults, render_fault::kStartedInside);
  }
  ray_renderer().tick(scene, state, at_depth(-0.001), kTick);
  const Rendering r = ray_renderer().tick(scene, state, at_depth(0.006), kTick);
  EXPECT_NEAR(r.force.z, 100 * 0.006 + 500 * 0.001, 1e-9);
  EXPECT_EQ(r.faults, 0u);
}

INSTANTIATE_TEST_SUITE_P(OfOneAndOfTwoParts, Layers, ::testing::Bool(), [](const auto& parameter) {
  return std::string(parameter.param ? "two" : "one");
});

/// A bar across the tip of a stylus, in a slot of 2 mm between two slabs, 30 mm deep.
class Hook : public ::testing::Test {
 protected:
  static constexpr double kSlot = 0.001, kIn = 0.03, kSpring = 500;  // m, m, N/m

  Hook()
      : scene_(
            {testing::placed_object(box({kSlot, -0.05, -0.04}, {0.05, 0.05, 0}), {}, kSpring, 0),
             testing::placed_object(box({-0.05, -0.05, -0.04}, {-kSlot, 0.05, 0}), {}, kSpring, 0)},
            true, Tool{{{{0, 0, 0}, {0, 0, 0.12}}, {{0, -0.01, 0}, {0, 0.01, 0}}}}),
        state_(scene_.initial_state()) {}

  /// Upright, the tip at x and a height over the slot, rolled about the stylus by an angle, rad.
  Rendering tick(double x, double height, double roll) {
    state_.measured_side = Vec3(std::cos(roll), std::sin(roll), 0);
    return ray_renderer().tick(scene_, state_, {{x, 0, height}, {x, 0, height + 0.12}}, kTick);
  }

  void go_in() {
    for (double height = 0.05; height > -kIn; height -= 5e-4) tick(0, height, 0);
    for (double x = 0; x < kPulled; x += 1e-4) tick(x, -kIn, 0);
  }

  static constexpr double kPulled = 0.004;  // m
  Scene scene_;
  RenderState state_;
};

TEST_F(Hook, ALockedTurnIsBoundedAndReleasedSmoothly) {
  go_in();
  Rendering r = tick(kPulled, -kIn, 0);
  const double held = kSpring * (kPulled - kSlot);
  EXPECT_NEAR(r.force.x, -held, 1e-9);
  constexpr double kTurn = 2e-3;  // rad a tick
  Vec3 last = r.force;
  double worst_lag = 0;
  int fading = 0;
  for (double roll = 0; roll < 0.5; roll += kTurn) {
    r = tick(kPulled, -kIn, roll);
    ASSERT_LE(glm::length(r.force - last), 2 * held * kTick / kFadeTime) << "at " << roll;
    last = r.force;
    worst_lag = std::max(worst_lag, state_.unions.groups[0].lag);
    fading += (r.faults & render_fault::kReleased) != 0 && r.contacts > 0;
    EXPECT_TRUE((r.faults & ~render_fault::kReleased) == 0);
  }
  EXPECT_NEAR(fading * kTick, kFadeTime, 2 * kTick);
  EXPECT_EQ(r.faults, render_fault::kReleased);
  EXPECT_EQ(r.force, Vec3(0));
  // The slot lets it turn by 0.1 rad; then it lags by more than the limit for the allowed time, and
  // while the force fades.
  EXPECT_GT(worst_lag, kMostLag);
  EXPECT_LE(worst_lag, kMostLag + (kMostLagTime + kFadeTime + 3 * kTick) / kTick * kTurn);
  // Once the tool has left the object, it is felt again.
  tick(0, 0.05, 0.5);
  EXPECT_EQ(tick(0, 0.05, 0).faults, 0u);
  go_in();
  r = tick(kPulled, -kIn, 0);
  EXPECT_NEAR(r.force.x, -held, 1e-9);
  EXPECT_EQ(r.faults, 0u);
}

TEST_F(Hook, ASmallerConstantLagIsNotReleased) {
  go_in();
  const double roll = 0.1 + 0.8 * kMostLag;
  for (double turned = 0; turned < roll; turned += 2e-3) tick(kPulled, -kIn, turned);
  Rendering r;
  for (int i = 0; i < 2000; ++i) r = tick(kPulled, -kIn, roll);
  EXPECT_EQ(r.faults, 0u);
  EXPECT_GT(state_.unions.groups[0].lag, 0.5 * kMostLag);
  EXPECT_GT(glm::length(r.force), 1);
}

}  // namespace
}  // namespace palpate::rendering
