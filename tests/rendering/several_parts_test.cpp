// Several objects, and concave objects made of convex parts.

#include <gtest/gtest.h>

#include <cstdint>

#include "runner/evidence/tick_meters.h"
#include "stimuli/convex_mesh.h"
#include "tests/shared/union_scenes.h"

namespace palpate::rendering {
namespace {

using testing::box;
using testing::kTick;
using testing::placed_object;

constexpr double kSpring = 800;  // N/m

/// A slab with its top at z = 0, from x = -50 to 50 mm, cut at these places, one object.
Scene slab_cut_at(const std::vector<double>& cuts, double overlap = 0) {
  std::vector<SceneObject> parts;
  double from = -0.05;
  for (std::size_t i = 0; i <= cuts.size(); ++i) {
    const double to = i < cuts.size() ? cuts[i] : 0.05;
    const double extra = i < cuts.size() ? overlap : 0;
    parts.push_back(
        placed_object(box({from, -0.05, -0.04}, {to + extra, 0.05, 0}), {}, kSpring, 0));
    from = to;
  }
  return Scene(parts);
}

class SeveralParts : public ::testing::TestWithParam<const Renderer*> {
 protected:
  static Rendering tick(const Scene& scene, RenderState& state, const LineProbe& probe) {
    return GetParam()->tick(scene, state, probe, kTick);
  }
};

LineProbe upright(double x, double depth) {
  return {{x, 0.003, -depth}, {x + 0.01, 0.013, 0.1 - depth}};
}

TEST_P(SeveralParts, SlidingOverASeamNeitherDoublesNorTraps) {
  for (const double overlap : {0.0, 0.001, 0.01}) {
    const Scene scene = slab_cut_at({0.0}, overlap);
    for (const double direction : {1.0, -1.0}) {
      for (const double pace : {1e-5, 1e-4, 3.3e-3}) {
        for (const double depth : {1e-5, 1e-3, 5e-3}) {
          RenderState state = scene.initial_state();
          tick(scene, state, upright(-0.03 * direction, -0.01));
          for (double gone = -0.03 - 0.37 * pace; gone < 0.03; gone += pace) {
            const Rendering r = tick(scene, state, upright(gone * direction, depth));
            ASSERT_LE(glm::length(r.force - Vec3(0, 0, kSpring * depth)), 1e-9)
                << "overlap " << overlap << " pace " << pace << " depth " << depth << " at "
                << gone * direction << ": " << r.force.x << " " << r.force.y << " " << r.force.z;
            ASSERT_GE(r.contacts, 1);
            ASSERT_EQ(r.object, 0);
          }
          const Rendering left = tick(scene, state, upright(0.03 * direction, -0.001));
          ASSERT_EQ(left.contacts, 0);
          ASSERT_EQ(left.force, Vec3());
        }
      }
    }
  }
}

TEST_P(SeveralParts, ManySeamsFeelLikeNone) {
  const Scene cut = slab_cut_at({-0.02, -0.011, -0.01, 0.003, 0.02});
  const Scene whole = slab_cut_at({});
  int in_contact = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Random random(seed, {41});
    const testing::Wave x(random), y(random), z(random);
    RenderState cut_state = cut.initial_state();
    RenderState whole_state = whole.initial_state();
    for (int i = 0; i < 400; ++i) {
      const double travelled = 0.02 * i;
      const Vec3 tip(0.04 * x(travelled), 0.04 * y(travelled),
                     i == 0 ? 0.01 : 0.003 * (z(travelled) - 0.3));
      const LineProbe probe{tip, tip + Vec3(0.01, -0.005, 0.1)};
      const Rendering a = tick(cut, cut_state, probe);
      const Rendering b = tick(whole, whole_state, probe);
      ASSERT_LE(glm::length(a.force - b.force), 1e-9)
          << "seed " << seed << " tick " << i << " tip " << tip.x << " " << tip.y << " " << tip.z
          << ", " << a.force.x << " " << a.force.y << " " << a.force.z << " for " << b.force.z;
      ASSERT_LE(glm::length(a.torque - b.torque), 1e-10);
      in_contact += b.contacts;
    }
  }
  EXPECT_GT(in_contact, 5000);
}

TEST_P(SeveralParts, ForcesOfSeparateObjectsAdd) {
  const auto left = box({-0.05, -0.02, -0.02}, {-0.01, 0.02, 0});
  const auto right = box({0.01, -0.02, -0.02}, {0.05, 0.02, 0.001});
  const std::vector<SceneObject> both{placed_object(left, {}, 500, 0),
                                      placed_object(right, {}, 900, 1)};
  const Scene together(both), only_left({both[0]}), only_right({placed_object(right, {}, 900, 0)});
  int both_touched = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {42});
    const testing::Wave3 place(random), turn(random);
    RenderState state = together.initial_state();
    RenderState left_state = only_left.initial_state();
    RenderState right_state = only_right.initial_state();
    for (int i = 0; i < 300; ++i) {
      const double travelled = 0.02 * i;
      const Vec3 direction = glm::normalize(Vec3(1, 0, 0) + 0.4 * turn(travelled));
      const Vec3 at = Vec3(0.03, 0.02, 0.006) * place(travelled) + Vec3(0, 0, i ? 0 : 0.1);
      const LineProbe probe = testing::probe_at(at, direction, 0.08, 0.5);
      const Rendering sum = tick(together, state, probe);
      const Rendering l = tick(only_left, left_state, probe);
      const Rendering r = tick(only_right, right_state, probe);
      ASSERT_EQ(sum.contacts, l.contacts + r.contacts) << "seed " << seed << " tick " << i;
      ASSERT_LE(glm::length(sum.force - l.force - r.force), 1e-12);
      ASSERT_LE(glm::length(sum.torque - l.torque - r.torque), 1e-13);
      ASSERT_LE(glm::length(sum.device1 - l.device1 - r.device1), 1e-12);
      ASSERT_LE(glm::length(sum.device2 - l.device2 - r.device2), 1e-12);
      const bool right_deeper = r.deepest.depth > l.deepest.depth;
      if (sum.contacts > 0) {
        ASSERT_EQ(sum.object, right_deeper ? 1 : 0);
        ASSERT_EQ(sum.deepest.depth, std::max(l.deepest.depth, r.deepest.depth));
      }
      both_touched += l.contacts && r.contacts;
    }
  }
  if (GetParam()->side_contact()) {
    EXPECT_GT(both_touched, 500);
  }
}

// The parts of one object share the ideal probe's displacement, other objects do not: wherever a
// compound stands among the scene's objects, the forces are those of each object alone.
TEST_P(SeveralParts, ACompoundBesideOthersFeelsAsAlone) {
  const auto slab = [](int object, double top, double spring) {
    std::vector<SceneObject> parts;
    for (const double from : {-0.05, -0.01, 0.02}) {
      parts.push_back(
          placed_object(box({from, -0.05, -0.04}, {from + 0.04, 0.05, top}), {}, spring, object));
    }
    return parts;
  };
  const auto block = [](int object, double top, double spring) {
    return std::vector<SceneObject>{
        placed_object(box({-0.03, -0.03, -0.03}, {0.03, 0.02, top}), {}, spring, object)};
  };
  const std::vector<std::vector<std::vector<SceneObject>>> scenes{
      {slab(0, 0, 800), block(1, 0.001, 300)},
      {block(0, 0, 300), slab(1, 0.001, 800)},
      {slab(0, 0.001, 500), slab(1, 0, 700)},
      {block(0, 0, 300), slab(1, 0.001, 800), block(2, 0.0005, 200)},
      {slab(0, 0, 800), block(1, 0.001, 300), slab(2, 0.0003, 100)},
  };
  for (std::size_t which = 0; which < scenes.size(); ++which) {
    std::vector<SceneObject> all;
    std::vector<Scene> alone;
    for (std::vector<SceneObject> parts : scenes[which]) {
      all.insert(all.end(), parts.begin(), parts.end());
      for (SceneObject& part : parts) part.object = 0;
      alone.emplace_back(parts);
    }
    const Scene together(all);
    RenderState state = together.initial_state();
    std::vector<RenderState> states;
    for (const Scene& scene : alone) states.push_back(scene.initial_state());
    int all_touched = 0;
    Random random(which, {43});
    const testing::Wave x(random), y(random), z(random);
    for (int i = 0; i < 1500; ++i) {
      const double travelled = 0.02 * i;
      const Vec3 tip(0.06 * x(travelled), 0.04 * y(travelled),
                     i == 0 ? 0.01 : 0.003 * (z(travelled) - 0.3));
      const LineProbe probe{tip, tip + Vec3(0.01, -0.005, 0.1)};
      const Rendering sum = tick(together, state, probe);
      Vec3 force, torque;
      int contacts = 0, touched = 0;
      for (std::size_t k = 0; k < alone.size(); ++k) {
        const Rendering r = tick(alone[k], states[k], probe);
        force += r.force;
        torque += r.torque;
        contacts += r.contacts;
        touched += r.contacts > 0;
      }
      ASSERT_EQ(sum.contacts, contacts) << "scene " << which << " tick " << i;
      ASSERT_LE(glm::length(sum.force - force), 1e-12) << "scene " << which << " tick " << i;
      ASSERT_LE(glm::length(sum.torque - torque), 1e-13) << "scene " << which << " tick " << i;
      all_touched += touched == static_cast<int>(alone.size());
    }
    EXPECT_GT(all_touched, 200) << "scene " << which;
  }
}

// Where the probe stood exactly on the surface, rounding decides the side; it must still be felt
// when it goes in.
TEST_P(SeveralParts, ASurfaceTouchedExactlyIsFeltOncePushed) {
  constexpr double kPressed = 1e-3;  // m
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const Pose pose{0.1 * Vec3(random.normal(), random.normal(), random.normal()),
                    stimuli::uniform_rotation(random)};
    const Scene scene({placed_object(box({-0.05, -0.05, -0.04}, {0, 0.05, 0}), pose, kSpring, 0),
                       placed_object(box({0, -0.05, -0.04}, {0.05, 0.05, 0}), pose, kSpring, 0)});
    // Near the seam (which is a crack as wide as rounding), or over one of the parts.
    const double x = (i % 3 == 0 ? 1e-6 : 0.08) * (random.unit() - 0.5);
    const double y = 0.08 * (random.unit() - 0.5);
    const auto at = [&](double z) {
      const Vec3 tip = pose.position + pose.orientation * Vec3(x, y, z);
      return LineProbe{tip, tip + pose.orientation * Vec3(0.01, 0.02, 0.1)};
    };
    RenderState state = scene.initial_state();
    tick(scene, state, at(0.01));
    tick(scene, state, at(0));
    tick(scene, state, at(0));
    const Rendering r = tick(scene, state, at(-kPressed));
    const Vec3 out = pose.orientation * Vec3(0, 0, 1);
    ASSERT_LE(glm::length(r.force - kSpring * kPressed * out), 1e-9) << i;
  }
}

TEST_P(SeveralParts, HundredsAreFeltAtOnceWithoutAllocation) {
  constexpr int kObjects = 300;
  constexpr double kPressed = 1e-3, kSoft = 2;  // m, N/m
  std::vector<SceneObject> objects;
  for (int i = 0; i < kObjects; ++i)
    objects.push_back(placed_object(box({-0.05, -0.05, -0.04}, {0.05, 0.05, 0}), {}, kSoft, i));
  const Scene scene(objects);
  RenderState state = scene.initial_state();
  tick(scene, state, upright(0, -0.01));
  const std::uint64_t before = runner::evidence::allocations();
  const Rendering r = tick(scene, state, upright(0, kPressed));
  EXPECT_EQ(runner::evidence::allocations(), before);
  EXPECT_EQ(r.contacts, kObjects);
  EXPECT_NEAR(r.force.z, kObjects * kSoft * kPressed, 1e-9);
  EXPECT_EQ(r.faults, 0u);
}

TEST_P(SeveralParts, InnerCornerPushesOutOfBothWalls) {
  const Scene corner(
      {placed_object(box({-0.05, -0.05, -0.04}, {0.05, 0.05, 0}), {}, kSpring, 0),
       placed_object(box({-0.09, -0.05, -0.04}, {-0.05, 0.05, 0.05}), {}, kSpring, 0)});
  RenderState state = corner.initial_state();
  const auto at = [](double x, double z) {
    return LineProbe{{-0.05 + x, 0.002, z}, {-0.05 + x + 0.05, 0.003, z + 0.08}};
  };
  tick(corner, state, at(0.01, 0.01));
  tick(corner, state, at(0.01, -0.001));
  Rendering r;
  for (int i = 0; i <= 120; ++i) r = tick(corner, state, at(0.01 - 1e-4 * i, -0.001));
  EXPECT_EQ(r.contacts, 2);
  EXPECT_LE(glm::length(r.force - kSpring * Vec3(0.002, 0, 0.001)), 1e-8)
      << r.force.x << " " << r.force.y << " " << r.force.z;
  // And back out of it.
  for (int i = 0; i <= 40; ++i) r = tick(corner, state, at(-0.002 + 1e-4 * i, -0.001));
  EXPECT_EQ(r.contacts, 1);
  EXPECT_LE(glm::length(r.force - kSpring * Vec3(0, 0, 0.001)), 1e-8);
}

TEST_P(SeveralParts, NoPartOfAClusterIsEnteredUnfelt) {
  int in_contact = 0, released = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Random random(seed, {43});
    std::vector<SceneObject> parts;
    for (std::uint64_t i = 0; i < 2 + seed % 3; ++i) {
      parts.push_back(
          placed_object(std::make_shared<const stimuli::ConvexMesh>(
                            testing::random_polyhedron(random, 12, Vec3(0.04, 0.03, 0.02))),
                        testing::random_pose(random, 0.025), kSpring, 0));
    }
    const Scene scene(parts);
    RenderState state = scene.initial_state();
    const stimuli::ConvexMesh around(stimuli::icosphere(0.05, 1));
    tick(scene, state, {Vec3(1, 1, 1), Vec3(1, 1, 1.1)});
    for (const LineProbe& probe : testing::wandering_path(random, around, 0.12, 400, 0.01)) {
      const Rendering r = tick(scene, state, probe);
      in_contact += r.contacts > 0;
      if (r.contacts > 0) continue;
      if ((r.faults & render_fault::kReleased) != 0) {  // hooked: no force until it has left
        ++released;
        continue;
      }
      for (const SceneObject& part : parts) {
        LineProbe local = testing::to_local(part.pose, probe);
        if (!GetParam()->side_contact()) local.tail = local.tip;
        ASSERT_LE(runner::evidence::reference_depth(*part.mesh, local).depth, 1e-9)
            << "seed " << seed;
      }
    }
  }
  EXPECT_GT(in_contact, 1000);
  EXPECT_LT(released, in_contact / 20);
}

TEST(SeveralPartsOfTheSide, StickAcrossASeamFeelsOneForce) {
  const Scene scene = slab_cut_at({0.0});
  for (const double x : {-0.02, -0.001, 0.0, 0.004, 0.02}) {
    RenderState state = scene.initial_state();
    const auto stick = [&](double depth) {
      return LineProbe{{x - 0.02, 0.003, -depth}, {x + 0.02, 0.003, -depth}};
    };
    ray_renderer().tick(scene, state, stick(-0.01), kTick);
    const Rendering r = ray_renderer().tick(scene, state, stick(0.001), kTick);
    EXPECT_LE(glm::length(r.force - Vec3(0, 0, 0.8)), 1e-9)
        << "x " << x << ": " << r.force.x << " " << r.force.y << " " << r.force.z;
    EXPECT_LE(glm::length(r.device1 + r.device2 - r.force), 1e-12);
  }
}

/// Scattered small boxes: a stylus comes down on one of them with its side, at any distance from
/// its tip and with any motion. The force is that of this box alone.
TEST(SeveralPartsOnTheSide, EachIsFoundAnywhereOnTheStylus) {
  const auto at = [](double x, int object) {
    return placed_object(box({x - 0.004, -0.004, -0.008}, {x + 0.004, 0.004, 0}), {}, kSpring,
                         object);
  };
  for (const double along : {0.002, 0.03, 0.06, 0.09, 0.115}) {
    for (const double height : {0.012, 0.03, 0.08}) {
      const Scene alone({at(along, 0)}),
          several({at(along, 0), at(-0.2, 1), at(0.35, 2), at(0.6, 3), at(-0.7, 4)});
      RenderState a = alone.initial_state(), b = several.initial_state();
      int felt = 0;
      for (int i = 0; i <= 400; ++i) {
        const double z = height - (height + 0.002) * std::min(1.0, i / 350.0);
        const LineProbe probe{{0, 0.001, z}, {0.12, 0.0005, z}};
        const Rendering expected = ray_renderer().tick(alone, a, probe, kTick);
        const Rendering found = ray_renderer().tick(several, b, probe, kTick);
        ASSERT_LE(glm::length(found.force - expected.force), 1e-12) << along << " " << i;
        ASSERT_LE(glm::length(found.torque - expected.torque), 1e-12) << along << " " << i;
        ASSERT_EQ(found.object, expected.object);
        felt += found.contacts > 0;
      }
      EXPECT_GT(felt, 30) << along;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both, SeveralParts, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
