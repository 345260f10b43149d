// Random scenes: several objects of overlapping parts, layers that may break, tools of up to 16
// segments, from a thousandth of a desk to a thousand desks wide, under hands that glide, rush and
// jump. Checks properties of every tick that hold by definition.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "rendering/union_contact.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/random_clusters.h"

namespace palpate::rendering {
namespace {

constexpr std::uint32_t kMayBe =
    render_fault::kReleased | render_fault::kContactCapped | render_fault::kStartedInside;

/// A scene and the path of a hand through it.
struct DrawnScene {
  std::uint64_t seed = 0;
  double scale = 1;  ///< 1: objects of some centimetres
  std::vector<SceneObject> parts;
  Tool tool;
  testing::ProbePath path;
};

/// One to three clusters, some with a second surface inside.
DrawnScene random_scene(std::uint64_t seed) {
  Random random(seed, {71});
  DrawnScene out;
  out.seed = seed;
  out.scale = std::pow(10, testing::uniform(random, -3, 3));
  const int objects = 1 + static_cast<int>(random.below(3));
  for (int object = 0; object < objects; ++object) {
    const Pose pose{
        0.03 * out.scale * static_cast<double>(object) * testing::random_direction(random),
        stimuli::uniform_rotation(random)};
    std::vector<SceneObject> own = testing::cluster(random, pose, out.scale);
    const std::size_t surface = own.size();
    if (random.below(2) == 0) {
      for (std::size_t i = 0; i < surface; ++i) {
        SceneObject inner = own[i];
        stimuli::PolygonSoup soup =
            testing::random_polyhedron(random, 12, Vec3(0.008, 0.006, 0.004));
        for (Vec3& v : soup.vertices) v *= out.scale;
        inner.mesh = testing::mesh_of(soup);
        inner.layer = 1;
        if (object == 0) inner.break_force = testing::uniform(random, 0.5, 5) * out.scale;
        own.push_back(inner);
      }
    }
    for (SceneObject& part : own) part.object = object;
    out.parts.insert(out.parts.end(), own.begin(), own.end());
  }
  out.tool = testing::random_tool(random, random.below(17), out.scale);
  const double speed = std::pow(10, testing::uniform(random, -1.5, 0.7));  // m/s, of the desk
  out.path = testing::cluster_path(random, 250, speed, out.scale);
  for (std::size_t jump = random.below(4); jump > 0; --jump)
    std::swap(out.path[20 + random.below(200)], out.path[20 + random.below(200)]);
  return out;
}

class RandomScene : public ::testing::Test {
 protected:
  void follow(const DrawnScene& drawn, const Renderer& renderer) {
    const bool sides = renderer.side_contact();
    const Scene scene(drawn.parts, sides, sides ? drawn.tool : Tool());
    RenderState state = scene.initial_state();
    for (const LineProbe& probe : drawn.path) {
      const Rendering r = renderer.tick(scene, state, probe, testing::kTick);
      ++ticks_;
      in_contact_ += r.contacts > 0;
      several_ += r.contacts > 1;
      ASSERT_EQ(r.faults & ~kMayBe, 0u);
      capped_ += (r.faults & render_fault::kContactCapped) != 0;
      for (const Vec3& v : {r.force, r.torque, r.device1, r.device2, r.ideal.tip, r.ideal.tail})
        ASSERT_TRUE(finite(v));
      expect_sums(state, probe, r, drawn.scale);
      for (std::uint32_t group = 0; group < scene.groups().size(); ++group)
        expect_ideal(scene, state, probe, group, sides, drawn.scale);
      if (HasFatalFailure()) return;
    }
  }

  std::size_t ticks_ = 0, in_contact_ = 0, several_ = 0, capped_ = 0, checked_ = 0;

 private:
  /// Force and torque on the hand are those of the contacts.
  static void expect_sums(const RenderState& state, const LineProbe& probe, const Rendering& r,
                          double scale) {
    if (state.unions.contacts.empty()) return;
    Vec3 force, torque;
    double all = 0;
    for (const PlacedContact& c : state.unions.contacts) {
      ASSERT_GE(c.loaded.force, 0);
      const Vec3 own = c.loaded.force * c.loaded.contact.normal;
      force += own;
      torque += glm::cross(c.place - probe.tip, own);
      all += c.loaded.force;
    }
    ASSERT_LE(glm::length(force - r.force), 1e-12 * all);
    ASSERT_LE(glm::length(r.device1 + r.device2 - r.force), 1e-9 * all);
    if (glm::length(r.torque) > 0) {
      ASSERT_LE(glm::length(torque - r.torque), 1e-11 * all * scale);
    }
  }

  /// The ideal tool is outside all parts, and the multipliers of the planes that hold it add up to
  /// its displacement.
  void expect_ideal(const Scene& scene, const RenderState& state, const LineProbe& probe,
                    std::uint32_t index, bool sides, double scale) {
    const PartGroup& group = scene.groups()[index];
    const GroupState& own = state.unions.groups[index];
    const ObjectState& object = state.unions.objects[group.object_state];
    if (!group.by_law || !group.felt || !own.touching || object.off || object.releasing) return;
    Vec3 way;
    double held = 0;
    for (const PlacedContact& c : state.unions.contacts) {
      if (!c.by_law || c.group != index) continue;
      ASSERT_GE(c.loaded.normal_displacement, 0);
      way += c.loaded.normal_displacement * c.loaded.contact.normal;
      held += c.loaded.normal_displacement;
    }
    const bool breaks =
        std::any_of(scene.breaking().begin(), scene.breaking().end(),
                    [&](const BreakingParts& parts) { return parts.group == index; });
    if (breaks) return;  // broken parts do not hold the tool
    ++checked_;
    if (held > 0) {
      ASSERT_LE(glm::length(way - own.shift), 1e-9 * held + 1e-13 * scale);
    }
    ToolPose pose = own.ideal;
    pose.tip = probe.tip + own.shift;
    const PlacedTool tool = place(sides ? scene.tool() : nullptr, sides, pose);
    for (std::uint32_t i = group.first_part; i < group.first_part + group.part_count; ++i) {
      for (std::size_t j = 0; j < tool.count; ++j) {
        const Vec3 from = pose.tip + tool.segments[j].from;
        ASSERT_LE(testing::segment_depth(scene.parts()[i], from, from + tool.segments[j].along),
                  1e-12 * scale)
            << "part " << i << " segment " << j;
      }
    }
  }
};

TEST_F(RandomScene, IdealToolStaysOutsideAndForcesBalance) {
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    const DrawnScene drawn = random_scene(seed);
    follow(drawn, seed % 5 == 0 ? point_renderer() : ray_renderer());
    ASSERT_FALSE(HasFatalFailure())
        << "seed " << seed << " tick " << ticks_ << " scale " << drawn.scale << " parts "
        << drawn.parts.size() << " segments " << drawn.tool.segments.size();
  }
  // The path has covered the critical situations.
  EXPECT_GT(in_contact_, ticks_ / 5);
  EXPECT_GT(several_, ticks_ / 20);
  EXPECT_GT(checked_, ticks_ / 5);
  EXPECT_LE(1000 * capped_, in_contact_);
}

}  // namespace
}  // namespace palpate::rendering
