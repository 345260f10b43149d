// Broad phase over many parts: leaves out exactly the parts out of reach.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "data/base/random.h"
#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {

Vec3 any_within(Random& random, double radius) {
  return radius * Vec3(2 * random.unit() - 1, 2 * random.unit() - 1, 2 * random.unit() - 1);
}

/// Objects of a ball and two boxes that overlap, 10 to 30 mm, anywhere in a cube.
/// \param half   m, half the cube's edge
/// \param floor  a ball of 3 m below them
Scene crowd(std::uint64_t seed, std::size_t count, double half, Tool tool = {},
            bool floor = false) {
  Random random(seed, {});
  const auto ball = std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(0.01, 1));
  const auto box = std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.03));
  std::vector<SceneObject> objects;
  for (std::size_t i = 0; i < count; ++i) {
    SceneObject object;
    object.mesh = i % 2 == 0 ? ball : box;
    object.object = static_cast<int>(i / 3);  // three convex parts each
    object.pose.position = i % 3 == 0 ? any_within(random, half)
                                      : objects.back().pose.position + any_within(random, 0.01);
    objects.push_back(std::move(object));
  }
  if (floor) {
    SceneObject object;
    object.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(1.5, 2));
    object.object = static_cast<int>(count);
    object.pose.position = {0, 0, -1.5 - half};
    objects.push_back(std::move(object));
  }
  return Scene(std::move(objects), true, std::move(tool));
}

/// Glides, with occasional leaps.
class Hand {
 public:
  explicit Hand(std::uint64_t seed) : random_(seed, {1}) {}

  LineProbe next() {
    if (random_.unit() < 0.01) tip_ = any_within(random_, 0.35);
    tip_ += any_within(random_, 0.002) + 0.001 * heading_;
    if (random_.unit() < 0.02) heading_ = any_within(random_, 1);
    axis_ = glm::normalize(axis_ + any_within(random_, 0.03));
    return {tip_, tip_ + 0.12 * axis_};
  }

 private:
  Random random_;
  Vec3 tip_{0.1, 0, 0}, heading_{0, 1, 0}, axis_{0, 0, 1};
};

/// m, from the definition: from the segment to a part's bounding sphere.
double gap(const ScenePart& part, const LineProbe& probe) {
  const Vec3 d = probe.tail - probe.tip, to = part.sphere_centre - probe.tip;
  const double t = std::clamp(glm::dot(to, d) / glm::dot(d, d), 0.0, 1.0);
  return glm::length(to - t * d) - part.sphere_radius;
}

TEST(NearParts, ListWhatALeapingProbeMayMeet) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scene scene = crowd(seed, 300, 0.3, {}, seed % 2 == 0);
    ASSERT_GT(scene.parts().size(), Scene::kFewParts);
    RenderState state = scene.initial_state();
    Hand hand(seed);
    std::size_t listed = 0, nearby = 0;
    for (int tick = 0; tick < 4000; ++tick) {
      const LineProbe probe = hand.next();
      update_near_parts(scene, state, probe);
      ASSERT_TRUE(std::is_sorted(state.near_parts.begin(), state.near_parts.end()));
      ASSERT_EQ(std::adjacent_find(state.near_parts.begin(), state.near_parts.end()),
                state.near_parts.end());
      for (std::uint32_t i = 0; i < scene.parts().size(); ++i) {
        if (std::binary_search(state.near_parts.begin(), state.near_parts.end(), i)) continue;
        const ScenePart& part = scene.parts()[i];
        ASSERT_GT(gap(part, probe), 0) << "seed " << seed << ", tick " << tick << ", part " << i;
        ASSERT_GE(gap(part, state.near_parts_pose) + 1e-12, state.clearance) << i;
      }
      listed += state.near_parts.size();
      nearby += state.nearby.parts.size();
      state.last = probe;
      state.has_last = true;
    }
    EXPECT_LT(static_cast<double>(listed) / 4000, 60) << seed;  // of 300
    EXPECT_LT(static_cast<double>(nearby) / 4000, 100) << seed;
  }
}

TEST(NearParts, OldListsChangeNoBitOfAForce) {
  Tool fork;
  fork.segments = {{Vec3(0), Vec3(0, 0, 0.12)},
                   {Vec3(-0.05, 0, 0), Vec3(0.05, 0, 0)},
                   {Vec3(0, -0.05, 0), Vec3(0, 0.05, 0)}};
  for (const Tool& tool : {Tool{}, fork}) {
    int touched = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Scene scene = crowd(seed, 120, 0.15, tool);
      const Renderer& renderer = ray_renderer();
      RenderState kept = scene.initial_state(), fresh = scene.initial_state();
      Hand hand(seed);
      for (int tick = 0; tick < 6000; ++tick) {
        const LineProbe probe = hand.next();
        fresh.clearance = fresh.nearby.room = 0;  // lists anew
        const Rendering a = renderer.tick(scene, kept, probe, 0.001);
        const Rendering b = renderer.tick(scene, fresh, probe, 0.001);
        ASSERT_EQ(a.contacts, b.contacts) << seed << ", " << tick;
        ASSERT_EQ(a.device1, b.device1) << seed << ", " << tick;
        ASSERT_EQ(a.device2, b.device2) << seed << ", " << tick;
        touched += a.contacts > 0;
      }
    }
    EXPECT_GT(touched, 500);
  }
}

}  // namespace
}  // namespace palpate::rendering
