// The contact law of unions: any tool on any object of convex parts (rendering/union_contact.h),
// by what must hold of it.

#include "rendering/union_contact.h"

#include <gtest/gtest.h>

#include <numbers>

#include "rendering/active_planes.h"
#include "runner/bench/allocation_count.h"
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

TEST_P(UnionContact, AValleyOverASeamHoldsTheTipFromBothSides) {
  stimuli::Random random(3);
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

TEST_P(UnionContact, GroovesOfAnyOpeningHoldTheTipInTheirApex) {
  for (int degrees = 2; degrees <= 178; degrees += 2) {
    const Scene scene(object_of(testing::groove(degrees * std::numbers::pi / 180), {}, kStiffness));
    RenderState state = scene.initial_state();
    const auto at = [&](const LineProbe& probe) { return tick(scene, state, probe); };
    Rendering r = press({1e-5, 0, -0.002}, 0.05, at);
    EXPECT_LE(glm::length(r.force - Vec3(-0.01, 0, 2)), 1e-6) << degrees;
    // Along the groove the tip slides, and nothing pops.
    for (int i = 0; i < 60; ++i) {
      r = at(standing_at({1e-5, 5e-5 * i, -0.002}));
      EXPECT_LE(glm::length(r.force - Vec3(-0.01, 0, 2)), 1e-6) << degrees;
    }
    EXPECT_EQ(r.faults, 0u) << degrees;
    // Up again it has left, whatever it rested on.
    for (double z = -0.002; z < 0.05; z += 1e-4) r = at(standing_at({0, 0, z}));
    if (degrees > 20) {
      EXPECT_EQ(r.contacts, 0) << degrees;
    }
  }
}

TEST_P(UnionContact, AStickInThePlaneOfAWallIsHeldByTheFloorAlone) {
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

TEST_P(UnionContact, ACrackAsWideAsRoundingLetsNothingIn) {
  constexpr double kPressed = 1e-3;
  stimuli::Random random(5);
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
    stimuli::Random random(seed, {51});
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

/// Boxes, slabs and hulls that overlap at random.
std::vector<SceneObject> cluster(stimuli::Random& random, const Pose& pose = {}, double scale = 1) {
  std::vector<SceneObject> parts;
  const std::uint64_t count = 2 + random.below(7);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto edge = [&] { return 0.01 + 0.03 * random.unit(); };
    Vec3 half = 0.5 * Vec3(edge(), edge(), edge());
    if (random.below(4) == 0) half.z = 5e-4;  // a thin plate
    stimuli::PolygonSoup soup =
        random.below(4) == 0 ? testing::random_polyhedron(random, 12, Vec3(0.02, 0.015, 0.01))
                             : box_soup(-half, half);
    for (Vec3& v : soup.vertices) v *= scale;
    const Pose at{0.02 * scale * Vec3(random.normal(), random.normal(), random.normal()),
                  stimuli::uniform_rotation(random)};
    parts.push_back(testing::placed_object(
        testing::mesh_of(soup),
        {pose.orientation * at.position + pose.position, pose.orientation * at.orientation},
        kStiffness, 0));
  }
  return parts;
}

Tool random_tool(stimuli::Random& random, std::size_t segments, double scale = 1) {
  Tool tool;
  for (std::size_t j = 0; j < segments; ++j) {
    const Vec3 from = j == 0 ? Vec3(0) : tool.segments.back().to;
    const Vec3 along =
        j == 0 ? Vec3(0, 0, 0.05) : 0.02 * Vec3(random.normal(), random.normal(), random.normal());
    tool.segments.push_back({from, from + scale * along});
  }
  return tool;
}

/// Through and round a cluster; about `speed` m/s.
testing::ProbePath cluster_path(stimuli::Random& random, std::size_t ticks, double speed,
                                double scale = 1) {
  const testing::Wave3 place(random), turn(random);
  testing::ProbePath path{{Vec3(scale, 0, 0), Vec3(scale, 0, 0.1 * scale)}};
  double travelled = 0;
  while (path.size() < ticks) {
    travelled += speed * kTick / 0.03 * (0.3 + 1.4 * random.unit());
    const Vec3 tip = 0.035 * scale * place(travelled);
    const Vec3 axis = testing::safe_direction(Vec3(0, 0, 0.7) + turn(0.5 * travelled));
    path.push_back({tip, tip + 0.1 * scale * axis});
  }
  return path;
}

/// m; how deep the ideal tool of the only group is inside of any part: by definition.
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

TEST_P(UnionContact, TheIdealToolIsNeverInsideOfAPart) {
  const bool sides = GetParam()->side_contact();
  std::size_t ticks = 0, in_contact = 0, lagging = 0;
  for (std::uint64_t seed = 0; seed < 160; ++seed) {
    stimuli::Random random(seed, {52});
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
      ASSERT_TRUE(testing::finite(r.force) && testing::finite(r.torque));
    }
  }
  EXPECT_GT(in_contact, ticks / 10);
  EXPECT_LE(lagging, in_contact / 100);
}

TEST_P(UnionContact, ThePartsOrderPlaceAndSizeDoNotMatter) {
  const bool sides = GetParam()->side_contact();
  std::size_t ticks = 0, same_order = 0, same_place = 0, same_size = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const std::size_t segments = sides ? seed % 3 : 0;
    stimuli::Random pose_random(seed, {54});
    const Pose pose = testing::random_pose(pose_random, 0.3);
    const double scale = 10;
    const auto made = [&](const Pose& at, double size, bool reversed) {
      stimuli::Random random(seed, {53});
      std::vector<SceneObject> parts = cluster(random, at, size);
      if (reversed) std::reverse(parts.begin(), parts.end());
      stimuli::Random tool_random(seed, {55});
      return Scene(parts, sides, random_tool(tool_random, segments, size));
    };
    const Scene plain = made({}, 1, false), reversed = made({}, 1, true),
                moved = made(pose, 1, false), large = made({}, scale, false);
    RenderState a = plain.initial_state(), b = reversed.initial_state(), c = moved.initial_state(),
                d = large.initial_state();
    stimuli::Random random(seed, {56});
    for (const LineProbe& probe : cluster_path(random, 300, 0.2)) {
      // The tool's side is measured, or a turned world would choose another.
      a.measured_side = b.measured_side = d.measured_side = Vec3(1, 0.2, 0.1);
      c.measured_side = pose.orientation * a.measured_side;
      const Rendering of_a = tick(plain, a, probe), of_b = tick(reversed, b, probe),
                      of_c = tick(moved, c, testing::to_world(pose, probe)),
                      of_d = tick(large, d, {scale * probe.tip, scale * probe.tail});
      ++ticks;
      // Where two ways are equally near, rounding may choose, and the ways then part; that is rare.
      same_order += glm::length(of_a.force - of_b.force) <= 1e-9;
      same_place += glm::length(pose.orientation * of_a.force - of_c.force) <= 1e-9;
      same_size += glm::length(scale * of_a.force - of_d.force) <= 1e-8;
    }
  }
  EXPECT_GE(same_order, ticks - ticks / 100);
  EXPECT_GE(same_place, ticks - ticks / 100);
  EXPECT_GE(same_size, ticks - ticks / 100);
}

TEST_P(UnionContact, AFastToolIsStoppedByAThinPlate) {
  const bool sides = GetParam()->side_contact();
  stimuli::Random random(7);
  for (int i = 0; i < 400; ++i) {
    const double thickness = 1e-3 * std::pow(0.01, random.unit());
    const std::size_t segments = sides ? static_cast<std::size_t>(i) % 4 : 0;
    const Pose pose = testing::random_pose(random, 0.1);
    const Scene scene(object_of({box_soup({-0.2, -0.2, -thickness}, {0, 0.2, 0}),
                                 box_soup({0, -0.2, -thickness}, {0.2, 0.2, 0})},
                                pose, kStiffness),
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

TEST_P(UnionContact, NothingIsAllocatedAndNoNaNGetsThrough) {
  const bool sides = GetParam()->side_contact();
  stimuli::Random random(8);
  for (std::size_t segments = 0; segments <= (sides ? 16u : 0u); segments += 4) {
    const Scene scene(cluster(random), sides, random_tool(random, segments));
    RenderState state = scene.initial_state();
    testing::ProbePath path = cluster_path(random, 400, 0.5);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    path[100].tip.x = nan;
    path[200].tail.z = HUGE_VAL;
    path[300].tail = path[300].tip;  // a stylus of no length
    std::vector<Rendering> out(path.size());
    const std::uint64_t before = runner::allocations();
    for (std::size_t i = 0; i < path.size(); ++i) {
      state.measured_side = i == 150 && segments > 0 ? Vec3(nan) : Vec3(0);
      out[i] = tick(scene, state, path[i]);
    }
    EXPECT_EQ(runner::allocations(), before);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const bool broken = i == 100 || i == 200 || (i == 150 && segments > 0);
      EXPECT_EQ((out[i].faults & render_fault::kNonFinite) != 0, broken) << i;
      EXPECT_TRUE(testing::finite(out[i].force) && testing::finite(out[i].torque) &&
                  testing::finite(out[i].device2) && testing::finite(out[i].ideal.tip));
      if (broken) {
        EXPECT_EQ(out[i].force, Vec3(0));
      }
    }
  }
}

TEST_P(UnionContact, WhatBeginsInsideIsFeltOnceItHasBeenLeft) {
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

// With a stylus along +z, a foot of 30 mm on a floor: the contact's place is off the axis.
/// Holds the point within rounding, and the shares add up to it.
void expect_held(const std::vector<PlaneBound>& planes, double narrow) {
  const ConstrainedPoint nearest = constrained_point(planes, 1e-16);
  ASSERT_TRUE(nearest.found) << narrow;
  Vec3 sum(0);
  double most = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    EXPECT_GT(nearest.multipliers[i], 0) << narrow;
    EXPECT_NEAR(glm::dot(planes[i].normal, nearest.point), planes[i].bound, 1e-16) << narrow;
    sum += nearest.multipliers[i] * planes[i].normal;
    most = std::max(most, nearest.multipliers[i]);
  }
  EXPECT_LE(glm::length(sum - nearest.point), 1e-15 * most + 1e-16) << narrow;
}

// Planes that are nearly antiparallel hold the point between them, some 2 cm away, with shares of
// up to kilometres that all but cancel.
TEST(ActivePlanes, HoldThePointExactlyInNarrowWedges) {
  for (int k = 0; k < 400; ++k) {
    const double narrow = std::pow(10, -1 - 0.0125 * k);  // rad
    const Vec3 x = glm::normalize(Vec3(1, 0.3 + 0.01 * k, -0.2));
    const Vec3 y = glm::normalize(glm::cross(x, Vec3(0.1, 0.2, 1)));
    const Vec3 p = glm::normalize(y + narrow * x), q = glm::normalize(-y + 0.3 * narrow * x);
    const Vec3 held = 0.02 * x + 0.007 * y;
    const std::vector<PlaneBound> wedge{{p, glm::dot(p, held)}, {q, glm::dot(q, held)}};
    expect_held(wedge, narrow);
    const Vec3 z = glm::cross(x, y), r = glm::normalize(z + 0.1 * x);
    const Vec3 corner = held + 0.01 * z;
    expect_held({{p, glm::dot(p, corner)}, {q, glm::dot(q, corner)}, {r, glm::dot(r, corner)}},
                narrow);
  }
}

TEST(ToolForces, AreSplitOnTwoDevicesAndTurnTheHand) {
  stimuli::Random random(11);
  int off_axis = 0;
  for (int i = 0; i < 300; ++i) {
    const std::size_t segments = 1 + random.below(Tool::kMostSegments);
    const Scene scene(cluster(random), true, random_tool(random, segments));
    RenderState state = scene.initial_state();
    for (const LineProbe& probe : cluster_path(random, 60, 0.5)) {
      const Rendering r = ray_renderer().tick(scene, state, probe, kTick);
      ASSERT_LE(glm::length(r.device1 + r.device2 - r.force), 1e-9 * (1 + glm::length(r.force)));
      if (r.contacts == 0) {
        ASSERT_EQ(r.segment, -1);
        continue;
      }
      ASSERT_GE(r.segment, 0);
      ASSERT_LT(r.segment, static_cast<int>(segments));
      ASSERT_NEAR(glm::length(r.ideal_side), 1, 1e-9);
      // The two devices' moment about any point of the stylus, as the contacts' save torsion.
      const Vec3 axis = glm::normalize(probe.tail - probe.tip);
      for (const double share : {-0.5, 0.0, 0.4, 1.0}) {
        const Vec3 hand = probe.tip + share * (probe.tail - probe.tip);
        Vec3 of_contacts(0);
        for (const PlacedContact& c : state.unions.contacts)
          of_contacts += glm::cross(c.place - hand, c.loaded.force * c.loaded.contact.normal);
        const Vec3 told = torque_about(hand, r.torque, probe.tip, r.force);
        ASSERT_LE(glm::length(told - of_contacts), 1e-9 * (1 + glm::length(told)));
        const Vec3 shown =
            glm::cross(probe.tip - hand, r.device1) + glm::cross(probe.tail - hand, r.device2);
        const Vec3 missing = shown - told;
        ASSERT_LE(glm::length(missing - glm::dot(missing, axis) * axis),
                  1e-9 * (1 + glm::length(told)));
        off_axis += glm::length(missing) > 1e-6;
      }
    }
  }
  EXPECT_GT(off_axis, 100);
}

// One segment from tip to tail is the plain stylus, and so are its pieces.
TEST(ToolForces, AToolThatIsTheStylusFeelsAsTheStylus) {
  stimuli::Random random(12);
  int in_contact = 0, same = 0;
  for (const std::size_t pieces : {1u, 2u, 5u, 16u}) {
    const auto mesh =
        testing::mesh_of(testing::random_polyhedron(random, 16, Vec3(0.03, 0.025, 0.02)));
    Tool tool;
    for (std::size_t j = 0; j < pieces; ++j)
      tool.segments.push_back(
          {{0, 0, 0.1 * static_cast<double>(j) / static_cast<double>(pieces)},
           {0, 0, 0.1 * static_cast<double>(j + 1) / static_cast<double>(pieces)}});
    const Scene plain({testing::placed_object(mesh)}),
        carried({testing::placed_object(mesh)}, true, tool);
    RenderState of_plain = plain.initial_state(), of_carried = carried.initial_state();
    for (const LineProbe& probe : testing::sliding_path(random, *mesh, 0.1, 300, 0.01, 0.1)) {
      const Rendering a = ray_renderer().tick(plain, of_plain, probe, kTick),
                      b = ray_renderer().tick(carried, of_carried, probe, kTick);
      in_contact += a.contacts > 0;
      same += a.contacts > 0 && glm::length(a.force - b.force) <= 1e-9;
    }
  }
  EXPECT_GT(in_contact, 600);
  EXPECT_EQ(same, in_contact);
}

INSTANTIATE_TEST_SUITE_P(Both, UnionContact, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
