// The guarantees of a tick to the servo: no allocation, repeatable bits, faults as bits, and no
// force from an object in which the probe began.

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "runner/evidence/tick_meters.h"
#include "stimuli/convex_mesh.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;
using testing::kTick;

constexpr double kHalf = 0.025;  // m

std::shared_ptr<const stimuli::ConvexMesh> small_cube() {
  return std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(2 * kHalf));
}

bool same_bits(const Rendering& a, const Rendering& b) {
  const auto same = [](const Vec3& u, const Vec3& v) { return std::memcmp(&u, &v, sizeof u) == 0; };
  return same(a.force, b.force) && same(a.torque, b.torque) && same(a.device1, b.device1) &&
         same(a.device2, b.device2) && same(a.deepest.point, b.deepest.point) &&
         same(a.deepest.normal, b.deepest.normal) && a.deepest.depth == b.deepest.depth &&
         a.deepest.along == b.deepest.along && a.deepest.type == b.deepest.type &&
         same(a.ideal.tip, b.ideal.tip) && same(a.ideal.tail, b.ideal.tail) &&
         a.contacts == b.contacts && a.object == b.object && a.faults == b.faults;
}

class Tick : public ::testing::TestWithParam<const Renderer*> {
 protected:
  static std::vector<SceneObject> two_objects(Random& random) {
    std::vector<SceneObject> objects;
    for (int i = 0; i < 2; ++i) {
      objects.push_back(
          testing::placed_object(std::make_shared<const stimuli::ConvexMesh>(testing::placed(
                                     testing::random_polyhedron(random, 20, Vec3(0.05, 0.04, 0.03)),
                                     Quat(1, 0, 0, 0), 1, Vec3())),
                                 testing::random_pose(random, 0.05), 800, i));
    }
    return objects;
  }

  static testing::ProbePath some_path(Random& random, const stimuli::ConvexMesh& mesh) {
    auto path = testing::wandering_path(random, mesh, 0.12, 300, 0.02);
    const auto jumps = testing::jumping_path(random, mesh, 0.12, 100);
    path.insert(path.end(), jumps.begin(), jumps.end());
    return path;
  }
};

TEST_P(Tick, AllocatesNothing) {
  if (!runner::evidence::counts_allocations())
    GTEST_SKIP() << "sanitizers bring their own operator new";
  const std::uint64_t probe_count = runner::evidence::allocations();
  int* volatile kept = new int(1);  // volatile: else the compiler may remove the pair
  delete kept;
  ASSERT_EQ(runner::evidence::allocations(), probe_count + 1) << "the counter does not count";
  int in_contact = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, {21});
    const auto objects = two_objects(random);
    const auto path = some_path(random, *objects[0].mesh);
    const Scene scene(objects);
    RenderState state = scene.initial_state();
    const std::uint64_t before = runner::evidence::allocations();
    for (const LineProbe& probe : path) {
      in_contact += GetParam()->tick(scene, state, probe, kTick).contacts > 0;
    }
    EXPECT_EQ(runner::evidence::allocations(), before) << "seed " << seed;
  }
  EXPECT_GT(in_contact, 500);
}

TEST_P(Tick, SamePathSameBits) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, {22});
    const auto objects = two_objects(random);
    const auto path = some_path(random, *objects[0].mesh);
    const Scene scene(objects);
    const Scene again(objects);
    RenderState state = scene.initial_state();
    RenderState state_again = again.initial_state();
    std::vector<Rendering> recorded;
    RenderState halfway;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (i == path.size() / 2) halfway = state;
      recorded.push_back(GetParam()->tick(scene, state, path[i], kTick));
      ASSERT_TRUE(same_bits(GetParam()->tick(again, state_again, path[i], kTick), recorded[i]))
          << "seed " << seed << " tick " << i;
    }
    // A copied state continues where it was copied.
    for (std::size_t i = path.size() / 2; i < path.size(); ++i) {
      ASSERT_TRUE(same_bits(GetParam()->tick(scene, halfway, path[i], kTick), recorded[i]))
          << "seed " << seed << " tick " << i;
    }
  }
}

TEST_P(Tick, FreeSpaceIsFree) {
  Bench bench(*GetParam(), small_cube());
  const LineProbe probe{{0.1, 0.2, 0.3}, {0.2, 0.2, 0.3}};
  for (int i = 0; i < 3; ++i) {
    const Rendering r = bench.tick(probe);
    EXPECT_EQ(testing::faults_of_tick(bench, probe, r), "");
    EXPECT_EQ(r.contacts, 0);
    EXPECT_EQ(r.faults, 0u);
  }
}

TEST_P(Tick, StartingInsideGivesNoForceUntilLeft) {
  Bench bench(*GetParam(), small_cube());
  const LineProbe inside{{0.002, 0.003, kHalf - 0.004}, {0.01, 0.02, 0.1}};
  const LineProbe outside = testing::moved(inside, {0, 0, 0.01});
  for (int i = 0; i < 3; ++i) {
    const Rendering r = bench.tick(testing::moved(inside, {0, 0, -0.001 * i}));
    EXPECT_EQ(r.contacts, 0);
    EXPECT_EQ(r.force, Vec3());
    EXPECT_EQ(r.faults, render_fault::kStartedInside);
  }
  const Rendering left = bench.tick(outside);
  EXPECT_EQ(left.contacts, 0);
  EXPECT_EQ(left.faults, 0u);
  const Rendering back = bench.tick(inside);
  EXPECT_EQ(back.contacts, 1);
  EXPECT_EQ(back.faults, 0u);
  EXPECT_NEAR(back.force.z, 800 * 0.004, 1e-12);
}

TEST_P(Tick, StartingInsideOneObjectLeavesTheOtherAlone) {
  const Scene scene(
      {testing::placed_object(small_cube(), {}, 800, 0),
       testing::placed_object(small_cube(), {Vec3(0.2, 0, 0), Quat(1, 0, 0, 0)}, 800, 1)});
  RenderState state = scene.initial_state();
  // The tip begins in one; it is carried out of it and into the other, and back.
  const LineProbe in_first{{0, 0.003, kHalf - 0.004}, {0, 0.003, 0.1}};
  const Vec3 up(0, 0, 0.02), across(0.2, 0, 0);
  EXPECT_EQ(GetParam()->tick(scene, state, in_first, kTick).faults, render_fault::kStartedInside);
  GetParam()->tick(scene, state, testing::moved(in_first, up), kTick);
  GetParam()->tick(scene, state, testing::moved(in_first, up + across), kTick);
  const Rendering second = GetParam()->tick(scene, state, testing::moved(in_first, across), kTick);
  EXPECT_EQ(second.contacts, 1);
  EXPECT_EQ(second.object, 1);
  EXPECT_EQ(second.faults, 0u);
}

TEST_P(Tick, BadPosesGiveNoForceGoodOnesRecover) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity()};
  const LineProbe above{{0.002, 0.003, kHalf + 0.01}, {0.01, 0.02, 0.1}};
  const LineProbe pressed = testing::moved(above, {0, 0, -0.011});
  for (const double value : bad) {
    for (int coordinate = 0; coordinate < 6; ++coordinate) {
      Bench bench(*GetParam(), small_cube());
      bench.tick(above);
      const Rendering good = bench.tick(pressed);
      ASSERT_EQ(good.contacts, 1);
      LineProbe broken = pressed;
      (coordinate < 3 ? broken.tip : broken.tail)[coordinate % 3] = value;
      for (int i = 0; i < 2; ++i) {
        const Rendering r = bench.tick(broken);
        EXPECT_EQ(r.force, Vec3());
        EXPECT_EQ(r.torque, Vec3());
        EXPECT_EQ(r.device1, Vec3());
        EXPECT_EQ(r.device2, Vec3());
        EXPECT_TRUE(r.faults & render_fault::kNonFinite);
      }
      const Rendering recovered = bench.tick(pressed);
      EXPECT_EQ(recovered.faults, 0u);
      EXPECT_EQ(recovered.contacts, 1);
      EXPECT_LE(glm::length(recovered.force - good.force), 1e-12);
    }
  }
}

TEST_P(Tick, FirstBadPoseIsNoStartInside) {
  Bench bench(*GetParam(), small_cube());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const LineProbe above{{0.002, 0.003, kHalf + 0.01}, {0.01, 0.02, 0.1}};
  EXPECT_EQ(bench.tick({Vec3(nan, nan, nan), Vec3(nan, nan, nan)}).faults,
            render_fault::kNonFinite);
  EXPECT_EQ(bench.tick(above).faults, 0u);
  EXPECT_EQ(bench.tick(testing::moved(above, {0, 0, -0.011})).contacts, 1);
}

TEST_P(Tick, ExtremePosesStayFiniteAndAreForgotten) {
  const double values[] = {0, 1e-320, 1e-160, 1e-5, 1e5, 1e100, 1e160, 1e308, -1e308};
  const LineProbe above{{0.002, 0.003, kHalf + 0.01}, {0.003, 0.004, kHalf + 0.02}};
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed, {23});
    Bench bench(*GetParam(), small_cube());
    for (int i = 0; i < 8; ++i) {
      LineProbe probe;
      for (int k = 0; k < 3; ++k) {
        probe.tip[k] = values[random.below(std::size(values))];
        probe.tail[k] = values[random.below(std::size(values))];
      }
      const Rendering r = bench.tick(probe);
      for (const Vec3& v : {r.force, r.torque, r.device1, r.device2}) {
        ASSERT_TRUE(finite(v)) << "seed " << seed << " tick " << i;
      }
    }
    const LineProbe pressed = testing::moved(above, {0, 0, -0.011});
    if (bench.tick(above).contacts == 0) {
      ASSERT_EQ(bench.tick(pressed).contacts, 1) << "seed " << seed;
    }
    // Once around the cube, so that every side that may have held the probe releases it.
    for (const Vec3& at : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(-1, 0, 0),
                           Vec3(0, -1, 0), Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0, 0, 1)}) {
      bench.tick({at, at + Vec3(0.001, 0.001, 0.001)});
    }
    const Rendering free = bench.tick(above);
    ASSERT_EQ(testing::faults_of_tick(bench, above, free), "") << "seed " << seed;
    ASSERT_EQ(free.contacts, 0) << "seed " << seed;
    const Rendering r = bench.tick(pressed);
    ASSERT_EQ(testing::faults_of_tick(bench, pressed, r), "") << "seed " << seed;
    ASSERT_EQ(r.contacts, 1) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Both, Tick, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
