// The declared properties of each method hold: whether it needs every tick, whether it keeps its
// side, and the depth of the probe.

#include "runner/evidence/accuracy/methods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {
namespace methods_by_hand {

constexpr double kHalf = 0.025;  // m, of the cube's edge

rendering::LineProbe tip_at(double x, double z) {
  const Vec3 tip(x, 0.002, z);
  return {tip, tip + Vec3(0, 0, 0.12)};
}

/// Beside the middle, from above to `z`, 0.5 mm a tick.
std::vector<rendering::LineProbe> way_down(double z) {
  std::vector<rendering::LineProbe> path;
  for (double at = 0.03; at > z; at -= 5e-4) path.push_back(tip_at(0.02, at));
  path.push_back(tip_at(0.02, z));
  return path;
}

TEST(Methods, HaveNamesAndDescriptionsOfTheirOwn) {
  std::set<std::string> names, descriptions;
  for (const MethodDefinition& method : contact_methods()) {
    EXPECT_TRUE(names.insert(method.name).second && !method.name.empty());
    EXPECT_TRUE(descriptions.insert(method.description).second && !method.description.empty());
  }
  EXPECT_TRUE(names.contains("tick") && names.contains("brute-force"));
}

TEST(Methods, GodObjectsKeepTheEntrySideAndOthersTakeTheNearest) {
  const stimuli::ConvexMesh cube(stimuli::cube(2 * kHalf));
  for (const MethodDefinition& method : contact_methods()) {
    if (method.name == "walk-cold") continue;  // its walk may end at any facet
    const auto made = method.make(cube, false);
    ContactEstimate last;
    for (const rendering::LineProbe& probe : way_down(0)) last = made->tick(probe);
    ASSERT_TRUE(last.touching) << method.name;
    // 25 mm below the top, through which it came; 5 mm from the nearest face, and so is the whole
    // stylus.
    EXPECT_NEAR(last.depth, method.keeps_side ? 0.025 : 0.005, 1e-6) << method.name;
    EXPECT_NEAR(last.normal.z, method.keeps_side ? 1 : 0, 1e-6) << method.name;
    EXPECT_NEAR(last.normal.x, method.keeps_side ? 0 : 1, 1e-6) << method.name;
  }
}

TEST(Methods, ThoseWithoutHistoryNeedNoTickBefore) {
  const stimuli::ConvexMesh cube(stimuli::cube(2 * kHalf));
  for (const MethodDefinition& method : contact_methods()) {
    if (method.has_history) continue;
    const auto used = method.make(cube, false);
    const ContactEstimate alone = used->tick(tip_at(0.003, 0.02));
    const ContactEstimate free = used->tick(tip_at(0.003, 0.026));
    EXPECT_EQ(used->tick(tip_at(0.003, 0.02)).depth, alone.depth) << method.name;
    if (method.name == "walk-cold") continue;  // its walk may end at any facet
    ASSERT_TRUE(alone.touching) << method.name;
    EXPECT_NEAR(alone.depth, 0.005, 1e-9) << method.name;
    EXPECT_NEAR(alone.normal.z, 1, 1e-9) << method.name;
    EXPECT_FALSE(free.touching) << method.name;
  }
}

TEST(Methods, MethodsThatKeepASideHaveAHistory) {
  for (const MethodDefinition& method : contact_methods()) {
    EXPECT_TRUE(method.has_history || !method.keeps_side) << method.name;
    // Other libraries start from their last result; these start anew.
    const bool peer = method.name == "bullet" || method.name == "fcl";
    const bool anew = method.name == "walk-cold" || method.visits_all;
    if (!peer && !anew) continue;
    EXPECT_EQ(method.has_history, peer) << method.name;
  }
}

}  // namespace methods_by_hand
}  // namespace
}  // namespace palpate::runner::evidence
