// No contact is missed at any speed of the hand, and each is felt on the side of entry.

#include <gtest/gtest.h>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;
using testing::uniform;

std::shared_ptr<const stimuli::ConvexMesh> shared(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

class FirstContact : public ::testing::TestWithParam<const Renderer*> {};

TEST_P(FirstContact, FastProbesStayOnThePlatesEntrySide) {
  const double thickness = 1e-4;
  for (const double side : {1.0, -1.0}) {
    Bench bench(*GetParam(), shared(testing::plate(0.1, thickness)));
    const Vec3 up(0, 0, side);
    const LineProbe before{0.0025 * up + Vec3(0.01, 0.02, 0), 0.1 * up + Vec3(0.02, 0, 0)};
    ASSERT_EQ(bench.tick(before).contacts, 0);
    const Rendering through = bench.tick(testing::moved(before, -0.005 * up));
    ASSERT_EQ(through.contacts, 1);
    EXPECT_LE(glm::length(through.deepest.normal - up), 1e-12);
    EXPECT_NEAR(through.deepest.depth, 0.0025 + thickness / 2, 1e-15);
    // And back out again on the same side.
    EXPECT_EQ(bench.tick(before).contacts, 0);
  }
}

TEST_P(FirstContact, APlateIsNotCrossedOnAnyPath) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed, {11});
    const double size = 2e-4 * std::pow(1e5, random.unit());
    const double thickness = size * std::pow(10, uniform(random, -4, -1));
    const double length = size * uniform(random, 0, 4) * static_cast<double>(random.below(3));
    Bench bench(*GetParam(), shared(testing::plate(size, thickness)),
                testing::random_pose(random, size));
    // Both ends well above the plate, then both well below; the deeper end goes through the inside.
    const double side = random.below(2) ? 1 : -1;
    const auto wholly_above = [&](double height) {
      const Vec3 low(size * uniform(random, -0.1, 0.1), size * uniform(random, -0.1, 0.1), height);
      Vec3 direction = testing::random_direction(random);
      direction.z = std::abs(direction.z) + 0.05;  // no flatter than the blend's angle
      return LineProbe{low, low + length * glm::normalize(direction)};
    };
    const LineProbe above = wholly_above(thickness / 2 + size * uniform(random, 1e-6, 3));
    LineProbe below = wholly_above(0);
    const double drop = glm::length(below.tail - below.tip) + size * uniform(random, 0.01, 3);
    below = testing::moved(below, Vec3(0, 0, -drop));
    const auto turned = [&](LineProbe probe) {
      if (side < 0) probe = {Vec3(1, 1, -1) * probe.tip, Vec3(1, 1, -1) * probe.tail};
      return testing::to_world(bench.pose(), probe);
    };
    ASSERT_EQ(bench.tick(turned(above)).contacts, 0) << "seed " << seed;
    const Rendering through = bench.tick(turned(below));
    ASSERT_EQ(through.contacts, 1) << "seed " << seed;
    const Vec3 up = bench.pose().orientation * Vec3(0, 0, side);
    ASSERT_LE(glm::length(through.deepest.normal - up), 1e-9) << "seed " << seed;
    ASSERT_NEAR(through.deepest.depth, drop + thickness / 2, 1e-12 * (size + drop))
        << "seed " << seed;
  }
}

TEST(FirstContactOfTheSide, FastStylusDoesNotPassThroughANeedle) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed, {12});
    const double size = 2e-4 * std::pow(1e5, random.unit());
    const double width = size * std::pow(10, uniform(random, -4, -1));
    Bench bench(ray_renderer(), shared(testing::needle(size, width)),
                testing::random_pose(random, size));
    // The needle lies along z; the stick lies along y and is swept along x. Both ends of each are
    // far from the crossing.
    const double from = width + size * uniform(random, 1e-6, 2);
    const double to = -width - size * uniform(random, 0.001, 2);
    const auto stick = [&](double x) {
      const Vec3 middle(x, size * uniform(random, -0.1, 0.1), size * uniform(random, -0.05, 0.05));
      const Vec3 half(0, size * uniform(random, 0.5, 2), size * uniform(random, -0.2, 0.2));
      return LineProbe{middle - half, middle + half};
    };
    ASSERT_EQ(bench.tick(testing::to_world(bench.pose(), stick(from))).contacts, 0);
    const LineProbe end = testing::to_world(bench.pose(), stick(to));
    const Rendering through = bench.tick(end);
    ASSERT_EQ(through.contacts, 1) << "seed " << seed;
    ASSERT_EQ(testing::faults_of_tick(bench, end, through), "") << "seed " << seed;
    const Vec3 x = bench.pose().orientation * Vec3(1, 0, 0);
    ASSERT_GT(glm::dot(through.deepest.normal, x), 0.5) << "seed " << seed;
  }
}

struct Tally {
  int entered = 0, stayed = 0, clipped = 0, held_by_face = 0;
};

// Follows the tick's motion in a hundred steps by the reference.
void check_against_fine_steps(Bench& bench, const testing::ProbePath& local_path, Tally& tally) {
  LineProbe last;
  bool was_free = false;
  for (std::size_t i = 0; i < local_path.size(); ++i) {
    const LineProbe probe = testing::to_world(bench.pose(), local_path[i]);
    const Rendering r = bench.tick(probe);
    const LineProbe felt = bench.felt(probe);
    const stimuli::ConvexMesh& mesh = bench.mesh();
    const double tolerance = 1e-9 * mesh.size() + bench.rounding(probe);
    const auto time = was_free ? runner::evidence::reference_first_contact(mesh, last, felt, 100)
                               : std::optional<double>();
    if (time) {
      ++tally.entered;
      const double depth = runner::evidence::reference_depth(mesh, felt).depth;
      if (depth > tolerance) {
        ++tally.stayed;
        ASSERT_EQ(r.contacts, 1) << "tick " << i << ", depth " << depth << " of " << mesh.size();
      } else {
        ++tally.clipped;
      }
      // It entered through a face and is still under that face at the end of the tick: the ideal
      // probe stays on it.
      const Vec3 entry =
          runner::evidence::reference_depth(mesh, testing::mixed(last, felt, *time)).normal;
      for (const stimuli::Facet& facet : mesh.facets()) {
        if (glm::length(facet.normal - entry) > 1e-12) continue;
        const double below =
            facet.offset - std::min(glm::dot(entry, felt.tip), glm::dot(entry, felt.tail));
        if (below < 1e-6 * mesh.size()) break;
        if (runner::evidence::reference_gap(mesh, testing::moved(felt, below * entry)) >
            1e-3 * tolerance)
          break;
        ++tally.held_by_face;
        ASSERT_EQ(r.contacts, 1) << "tick " << i << ", below its face by " << below;
        ASSERT_NEAR(r.deepest.depth, below, tolerance) << "tick " << i;
      }
    }
    was_free = r.contacts == 0 && runner::evidence::reference_depth(mesh, felt).depth < 0;
    last = felt;
  }
}

TEST_P(FirstContact, AgreesWithTheMotionInAHundredSteps) {
  Tally tally;
  for (std::uint64_t seed = 0; seed < 150 && !HasFatalFailure(); ++seed) {
    Random random(seed, {13});
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random));
    const double length = mesh->size() * uniform(random, 0, 3) * static_cast<double>(seed % 4);
    const double step = 0.02 * std::pow(500, random.unit());
    const auto path = seed % 3 ? testing::fast_passes(random, *mesh, length, 150, step)
                               : testing::jumping_path(random, *mesh, length, 100);
    Bench bench(*GetParam(), mesh, testing::random_pose(random, mesh->size()));
    SCOPED_TRACE("seed " + std::to_string(seed));
    check_against_fine_steps(bench, path, tally);
  }
  EXPECT_GT(tally.stayed, 100);
  EXPECT_GT(tally.clipped, 100);
  EXPECT_GT(tally.held_by_face, 100);
}

TEST_P(FirstContact, NearestSideIsAsDeepAsTheReference) {
  int plunges = 0;
  for (std::uint64_t seed = 0; seed < 250; ++seed) {
    Random random(seed, {14});
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random));
    const double length = mesh->size() * uniform(random, 0, 3);
    const Pose pose = testing::random_pose(random, mesh->size());
    for (const LineProbe& end : testing::jumping_path(random, *mesh, length, 20)) {
      Bench bench(*GetParam(), mesh, pose);
      const LineProbe deep = bench.felt(testing::to_world(pose, end));
      const runner::evidence::ReferenceDepth goal = runner::evidence::reference_depth(*mesh, deep);
      if (goal.depth < 1e-4 * mesh->size()) continue;
      ++plunges;
      // Straight in against the normal of the nearest side, which stays the nearest all the way.
      const double start = goal.depth + 0.1 * mesh->size();
      const int ticks = 1 + static_cast<int>(random.below(20));
      for (int i = 0; i <= ticks; ++i) {
        const double out = start * (1 - static_cast<double>(i) / ticks);
        const LineProbe probe = testing::to_world(pose, testing::moved(end, out * goal.normal));
        const Rendering r = bench.tick(probe);
        if (out > goal.depth + 1e-9 * mesh->size()) {
          ASSERT_EQ(r.contacts, 0) << "seed " << seed << " tick " << i;
        } else if (out < goal.depth - 1e-9 * mesh->size()) {
          const double rounding = bench.rounding(probe);
          ASSERT_EQ(r.contacts, 1) << "seed " << seed << " tick " << i << " of " << ticks;
          ASSERT_NEAR(r.deepest.depth, goal.depth - out, 1e-12 * mesh->size() + rounding)
              << "seed " << seed << " tick " << i << " of " << ticks;
        }
      }
    }
  }
  EXPECT_GT(plunges, 300);
}

INSTANTIATE_TEST_SUITE_P(Both, FirstContact, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
