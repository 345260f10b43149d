// The contact law of unions: any tool on any object of convex parts (rendering/union_contact.h), by
// properties that it must have.

#include "rendering/union_contact.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>

#include "rendering/union_state.h"
#include "runner/evidence/tick_meters.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/union_scenes.h"

namespace palpate::rendering {
namespace {

using testing::box_soup;
using testing::kTick;
using testing::object_of;

constexpr double kStiffness = 1000;  // N/m

class UnionContact : public ::testing::TestWithParam<const Renderer*> {
 protected:
  static Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe) {
    return GetParam()->tick(scene, state, probe, kTick);
  }
};

LineProbe standing_at(const Vec3& tip) { return {tip, tip + Vec3(0, 0, 0.1)}; }

/// From above onto `tip`, in steps of 0.1 mm.
template <class Tick>
Rendering press(const Vec3& tip, double from_height, const Tick& tick) {
  Rendering r;
  for (double above = from_height; above > 0; above -= 1e-4)
    r = tick(standing_at(tip + Vec3(0, 0, above)));
  return tick(standing_at(tip));
}

/// Two slopes of 30 degrees that abut exactly under the valley.
std::vector<stimuli::PolygonSoup> valley() {
  const double run = 0.06 * std::cos(std::numbers::pi / 6),
               rise = 0.06 * std::sin(std::numbers::pi / 6);
  std::vector<stimuli::PolygonSoup> out;
  for (const double side : {-1.0, 1.0}) {
    stimuli::PolygonSoup block = box_soup({0, -0.1, -0.03}, {run, 0.1, 0});
    for (Vec3& v : block.vertices) {
      if (v.z > -0.01 && v.x > 0) v.z = rise;
      v.x *= side;
    }
    if (side < 0) {
      for (auto& face : block.faces) std::reverse(face.begin(), face.end());
    }
    out.push_back(block);
  }
  return out;
}

TEST_P(UnionContact, ValleyOverSeamHoldsTipFromBothSides) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 50; ++i) {
    const Pose pose = i == 0 ? Pose{} : testing::random_pose(random, 0.2);
    const Scene scene(object_of(valley(), pose, kStiffness));
    RenderState state = scene.initial_state();
    const Rendering r = press({0.001, 0, -0.002}, 0.006, [&](const LineProbe& probe) {
      return tick(scene, state, testing::to_world(pose, probe));
    });
    EXPECT_LE(glm::length(r.force - pose.orientation * Vec3(-1, 0, 2)), 1e-9) << i;
    EXPECT_LE(glm::length(r.ideal.tip - pose.position), 1e-12) << i;
    EXPECT_EQ(r.contacts, 2);
    EXPECT_EQ(r.faults, 0u);
  }
}

TEST_P(UnionContact, AnyGrooveHoldsTheTipInItsApex) {
  for (int degrees = 2; degrees <= 178; degrees += 2) {
    const Scene scene(object_of(testing::groove(degrees * std::numbers::pi / 180), {}, kStiffness));
    RenderState state = scene.initial_state();
    const auto at = [&](const LineProbe& probe) { return tick(scene, state, probe); };
    Rendering r = press({1e-5, 0, -0.002}, 0.05, at);
    EXPECT_LE(glm::length(r.force - Vec3(-0.01, 0, 2)), 1e-6) << degrees;
    // Along the groove the tip slides without jumps.
    for (int i = 0; i < 60; ++i) {
      r = at(standing_at({1e-5, 5e-5 * i, -0.002}));
      EXPECT_LE(glm::length(r.force - Vec3(-0.01, 0, 2)), 1e-6) << degrees;
    }
    EXPECT_EQ(r.faults, 0u) << degrees;
    // Moved up again, it has left its contacts.
    for (double z = -0.002; z < 0.05; z += 1e-4) r = at(standing_at({0, 0, z}));
    if (degrees > 20) {
      EXPECT_EQ(r.contacts, 0) << degrees;
    }
  }
}

TEST_P(UnionContact, FloorAloneHoldsSticksInAWallsPlane) {
  const Scene scene(object_of(
      {box_soup({-0.06, -0.1, -0.03}, {0.03, 0.1, 0}), box_soup({0, -0.1, 0}, {0.03, 0.1, 0.06})},
      {}, kStiffness));
  RenderState state = scene.initial_state();
  Rendering r;
  for (double z = 0.02; z > -0.002; z -= 5e-5) {
    r = tick(scene, state, {{0, 0, z}, {0, 0, z + 0.05}});
    ASSERT_LE(glm::length(r.force - Vec3(0, 0, kStiffness * std::max(0.0, -z))), 1e-9) << z;
  }
}

TEST_P(UnionContact, CracksAsWideAsRoundingLetNothingIn) {
  constexpr double kPressed = 1e-3;
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 300; ++i) {
    const Pose pose = testing::random_pose(random, 0.1);
    const Scene scene(object_of({box_soup({-0.05, -0.05, -0.04}, {0, 0.05, 0}),
                                 box_soup({0, -0.05, -0.04}, {0.05, 0.05, 0})},
                                pose, kStiffness));
    RenderState state = scene.initial_state();
    const double y = 0.08 * (random.unit() - 0.5);
    Rendering r;
    for (const double z : {0.01, 0.0, 0.0, -kPressed, -kPressed}) {
      const LineProbe local{{0, y, z}, {0, y + 0.02, z + 0.1}};
      r = tick(scene, state, testing::to_world(pose, local));
    }
    EXPECT_LE(glm::length(r.force - pose.orientation * Vec3(0, 0, kStiffness * kPressed)), 1e-7)
        << i;
  }
}

TEST_P(UnionContact, CuttingAPartInTwoChangesNothing) {
  const bool sides = GetParam()->side_contact();
  int in_contact = 0, compared = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {51});
    const stimuli::PolygonSoup solid =
        seed % 2 == 0 ? box_soup({-0.03, -0.025, -0.02}, {0.03, 0.025, 0.02})
                      : testing::random_polyhedron(random, 14, Vec3(0.03, 0.025, 0.02));
    const Pose pose = testing::random_pose(random, 0.05);
    const Vec3 through = 0.008 * Vec3(random.normal(), random.normal(), random.normal());
    const Scene whole(object_of({solid}, pose, kStiffness)),
        cut(object_of(testing::cut_in_two(solid, testing::random_direction(random), through), pose,
                      kStiffness));
    ASSERT_TRUE(cut.features().unions);
    ASSERT_FALSE(whole.features().unions);
    RenderState whole_state = whole.initial_state(), cut_state = cut.initial_state();
    for (const LineProbe& local :
         testing::sliding_path(random, *whole.parts()[0].mesh, 0.1, 300, 0.01, 0.1, sides)) {
      const LineProbe probe = testing::to_world(pose, local);
      const Rendering a = tick(whole, whole_state, probe), b = tick(cut, cut_state, probe);
      in_contact += a.contacts > 0;
      ++compared;
      ASSERT_LE(glm::length(a.force - b.force), 1e-12 * 0.06 * kStiffness)
          << "seed " << seed << ": " << a.force.x << " " << a.force.y << " " << a.force.z
          << ", cut " << b.force.x << " " << b.force.y << " " << b.force.z;
      ASSERT_LE(glm::length(a.torque - b.torque), 1e-12) << "seed " << seed;
      ASSERT_LE(glm::length(a.deepest.point - b.deepest.point), 1e-11) << "seed " << seed;
    }
  }
  EXPECT_GT(in_contact, compared / 2);
}

TEST_P(UnionContact, StartInsideIsFeltOnceItLeft) {
  const Scene scene(object_of(
      {box_soup({-0.05, -0.05, -0.04}, {0, 0.05, 0}), box_soup({0, -0.05, -0.04}, {0.05, 0.05, 0})},
      {}, kStiffness));
  RenderState state = scene.initial_state();
  for (const double x : {-0.01, 0.01}) {  // in one part, then in the other
    const Rendering r = tick(scene, state, standing_at({x, 0, -0.01}));
    EXPECT_EQ(r.contacts, 0);
    EXPECT_EQ(r.faults, render_fault::kStartedInside);
  }
  EXPECT_EQ(tick(scene, state, standing_at({0.01, 0, 0.001})).faults, 0u);
  const Rendering r = tick(scene, state, standing_at({0.01, 0, -0.001}));
  EXPECT_NEAR(r.force.z, kStiffness * 0.001, 1e-9);
  EXPECT_EQ(r.faults, 0u);
}

INSTANTIATE_TEST_SUITE_P(Both, UnionContact, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
