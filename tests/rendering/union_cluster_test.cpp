// The contact law of unions (rendering/union_contact.h) on random clusters of parts: properties
// that must hold at every tick.

#include <gtest/gtest.h>

#include <cstdint>

#include "rendering/union_contact.h"
#include "runner/evidence/tick_meters.h"
#include "tests/shared/random_clusters.h"

namespace palpate::rendering {
namespace {

using testing::box_soup;
using testing::cluster;
using testing::cluster_path;
using testing::kTick;
using testing::object_of;
using testing::random_tool;

class UnionCluster : public ::testing::TestWithParam<const Renderer*> {
 protected:
  static Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe) {
    return GetParam()->tick(scene, state, probe, kTick);
  }
};

/// m, depth of the only group's ideal tool inside any part, by definition.
double deepest_inside(const Scene& scene, const RenderState& state, bool sides) {
  const GroupState& group = state.unions.groups[0];
  const ToolPose& pose = group.touching ? group.ideal : state.unions.last;
  const PlacedTool tool = place(sides ? scene.tool() : nullptr, sides, pose);
  double deepest = -HUGE_VAL;
  for (const ScenePart& part : scene.parts()) {
    for (std::size_t j = 0; j < tool.count; ++j) {
      const Vec3 from = pose.tip + tool.segments[j].from;
      deepest =
          std::max(deepest, testing::segment_depth(part, from, from + tool.segments[j].along));
    }
  }
  return deepest;
}

TEST_P(UnionCluster, IdealToolIsNeverInsideAPart) {
  const bool sides = GetParam()->side_contact();
  std::size_t ticks = 0, in_contact = 0, lagging = 0;
  for (std::uint64_t seed = 0; seed < 160; ++seed) {
    Random random(seed, {52});
    const std::size_t segments = sides ? seed % 4 : 0;  // 0: the plain stylus
    const Scene scene(cluster(random), sides, random_tool(random, segments));
    RenderState state = scene.initial_state();
    for (const LineProbe& probe : cluster_path(random, 300, seed % 3 == 0 ? 5 : 0.3)) {
      const Rendering r = tick(scene, state, probe);
      if (state.unions.objects[0].off) continue;
      ++ticks;
      in_contact += r.contacts > 0;
      lagging += r.contacts > 0 && state.unions.groups[0].lag > kMostLag;
      ASSERT_LE(deepest_inside(scene, state, sides), 1e-12) << "seed " << seed << " tick " << ticks;
      ASSERT_TRUE(finite(r.force) && finite(r.torque));
    }
  }
  EXPECT_GT(in_contact, ticks / 10);
  EXPECT_LE(lagging, in_contact / 100);
}

TEST_P(UnionCluster, PartsOrderPlaceAndSizeDoNotMatter) {
  const bool sides = GetParam()->side_contact();
  std::size_t ticks = 0, same_order = 0, same_place = 0, same_size = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const std::size_t segments = sides ? seed % 3 : 0;
    Random pose_random(seed, {54});
    const Pose pose = testing::random_pose(pose_random, 0.3);
    const double scale = 10;
    const auto made = [&](const Pose& at, double size, bool reversed) {
      Random random(seed, {53});
      std::vector<SceneObject> parts = cluster(random, at, size);
      if (reversed) std::reverse(parts.begin(), parts.end());
      Random tool_random(seed, {55});
      return Scene(parts, sides, random_tool(tool_random, segments, size));
    };
    const Scene plain = made({}, 1, false), reversed = made({}, 1, true),
                moved = made(pose, 1, false), large = made({}, scale, false);
    RenderState a = plain.initial_state(), b = reversed.initial_state(), c = moved.initial_state(),
                d = large.initial_state();
    Random random(seed, {56});
    for (const LineProbe& probe : cluster_path(random, 300, 0.2)) {
      // The tool's side is measured; otherwise a rotated world would choose another.
      a.measured_side = b.measured_side = d.measured_side = Vec3(1, 0.2, 0.1);
      c.measured_side = pose.orientation * a.measured_side;
      const Rendering of_a = tick(plain, a, probe), of_b = tick(reversed, b, probe),
                      of_c = tick(moved, c, testing::to_world(pose, probe)),
                      of_d = tick(large, d, {scale * probe.tip, scale * probe.tail});
      ++ticks;
      // Where two places are equally near, rounding may choose, and the paths then diverge; that is
      // rare.
      same_order += glm::length(of_a.force - of_b.force) <= 1e-9;
      same_place += glm::length(pose.orientation * of_a.force - of_c.force) <= 1e-9;
      same_size += glm::length(scale * of_a.force - of_d.force) <= 1e-8;
    }
  }
  EXPECT_GE(same_order, ticks - ticks / 100);
  EXPECT_GE(same_place, ticks - ticks / 100);
  EXPECT_GE(same_size, ticks - ticks / 100);
}

TEST_P(UnionCluster, ThinPlateStopsAFastTool) {
  const bool sides = GetParam()->side_contact();
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  for (int i = 0; i < 400; ++i) {
    const double thickness = 1e-3 * std::pow(0.01, random.unit());
    const std::size_t segments = sides ? static_cast<std::size_t>(i) % 4 : 0;
    const Pose pose = testing::random_pose(random, 0.1);
    const Scene scene(object_of({box_soup({-0.2, -0.2, -thickness}, {0, 0.2, 0}),
                                 box_soup({0, -0.2, -thickness}, {0.2, 0.2, 0})},
                                pose, testing::kClusterStiffness),
                      sides, random_tool(random, segments));
    RenderState state = scene.initial_state();
    const Vec3 drift(0.004 * (random.unit() - 0.5), 0.004 * (random.unit() - 0.5),
                     -0.005);  // m a tick
    Vec3 tip(0, 0, 0.16 + 0.005 * random.unit());
    Rendering r;
    for (int k = 0; k < 50; ++k, tip += drift) {
      r = tick(scene, state, testing::to_world(pose, {tip, tip + Vec3(0, 0, 0.1)}));
      const double held = glm::dot(pose.orientation * Vec3(0, 0, 1), r.ideal.tip - pose.position);
      if (segments < 2) {
        ASSERT_GE(held, -1e-9) << i << " tick " << k;
      }
      ASSERT_LE(deepest_inside(scene, state, sides), 1e-12) << i << " tick " << k;
    }
    EXPECT_GT(r.contacts, 0) << i;
    EXPECT_GT(glm::dot(pose.orientation * Vec3(0, 0, 1), r.force), 0) << i;
  }
}

TEST_P(UnionCluster, AllocatesNothingAndLetsNoNaNThrough) {
  const bool sides = GetParam()->side_contact();
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (std::size_t segments = 0; segments <= (sides ? 16u : 0u); segments += 4) {
    const Scene scene(cluster(random), sides, random_tool(random, segments));
    RenderState state = scene.initial_state();
    testing::ProbePath path = cluster_path(random, 400, 0.5);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    path[100].tip.x = nan;
    path[200].tail.z = HUGE_VAL;
    path[300].tail = path[300].tip;  // a stylus of length 0
    std::vector<Rendering> out(path.size());
    const std::uint64_t before = runner::evidence::allocations();
    for (std::size_t i = 0; i < path.size(); ++i) {
      state.measured_side = i == 150 && segments > 0 ? Vec3(nan) : Vec3(0);
      out[i] = tick(scene, state, path[i]);
    }
    EXPECT_EQ(runner::evidence::allocations(), before);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const bool broken = i == 100 || i == 200 || (i == 150 && segments > 0);
      EXPECT_EQ((out[i].faults & render_fault::kNonFinite) != 0, broken) << i;
      EXPECT_TRUE(finite(out[i].force) && finite(out[i].torque) && finite(out[i].device2) &&
                  finite(out[i].ideal.tip));
      if (broken) {
        EXPECT_EQ(out[i].force, Vec3(0));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both, UnionCluster, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
