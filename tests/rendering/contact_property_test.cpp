// Random objects and random paths over them: properties that must hold at every tick.

#include <gtest/gtest.h>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;
using testing::PathCheck;
using testing::ProbePath;

class EveryTick : public ::testing::TestWithParam<const Renderer*> {
 protected:
  /// Probes shorter than, about as long as, and much longer than the object.
  static double random_length(Random& random, const stimuli::ConvexMesh& mesh) {
    const double shares[] = {0, 0.05, 0.5, 1, 3, 10};
    return shares[random.below(6)] * testing::uniform(random, 0.7, 1.3) * mesh.size();
  }

  template <class MakePath>
  PathCheck follow(std::uint64_t kind, std::uint64_t seeds, MakePath&& make_path) {
    PathCheck check;
    for (std::uint64_t seed = 0; seed < seeds && !HasFailure(); ++seed) {
      Random random(seed, {kind});
      const auto mesh =
          std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random));
      const double length = random_length(random, *mesh);
      const ProbePath path = make_path(random, *mesh, length);
      Bench bench(*GetParam(), mesh, testing::random_pose(random, mesh->size()));
      EXPECT_EQ(check.follow(bench, path), "")
          << "seed " << seed << ", facets " << mesh->facets().size() << ", size " << mesh->size()
          << ", length " << length;
    }
    return check;
  }
};

TEST_P(EveryTick, IsExactWhenSlidingSlowly) {
  const bool side = GetParam()->side_contact();
  const PathCheck check =
      follow(1, 300, [side](Random& random, const stimuli::ConvexMesh& mesh, double length) {
        return testing::sliding_path(random, mesh, length, 300, 0.005, 0.3, side);
      });
  EXPECT_GT(check.in_contact, check.ticks / 3);
  EXPECT_GT(check.free, check.ticks / 50);
}

TEST_P(EveryTick, IsExactWhenSlidingFastAndDeep) {
  const bool side = GetParam()->side_contact();
  const PathCheck check =
      follow(2, 300, [side](Random& random, const stimuli::ConvexMesh& mesh, double length) {
        return testing::sliding_path(random, mesh, length, 200, 0.05, 1.5, side);
      });
  EXPECT_GT(check.in_contact, check.ticks / 3);
}

TEST_P(EveryTick, IsExactWhenWandering) {
  const PathCheck check =
      follow(3, 600, [](Random& random, const stimuli::ConvexMesh& mesh, double length) {
        return testing::wandering_path(random, mesh, length, 400, 0.01);
      });
  EXPECT_GT(check.in_contact, check.ticks / 50);
  EXPECT_GT(check.free, check.ticks / 50);
}

TEST_P(EveryTick, IsExactWhenPassingFast) {
  const PathCheck check =
      follow(4, 600, [](Random& random, const stimuli::ConvexMesh& mesh, double length) {
        const double step = 0.02 * std::pow(1000, random.unit());
        return testing::fast_passes(random, mesh, length, 300, step);
      });
  EXPECT_GT(check.in_contact, check.ticks / 50);
}

TEST_P(EveryTick, IsExactWhenJumping) {
  const PathCheck check =
      follow(5, 600, [](Random& random, const stimuli::ConvexMesh& mesh, double length) {
        return testing::jumping_path(random, mesh, length, 200);
      });
  EXPECT_GT(check.in_contact, check.ticks / 10);
}

// A rim of n corners is a ring of n silhouette edges on about n facets: the longest path of a walk.
// Jumps make it walk halfway around.
TEST_P(EveryTick, IsExactWhenJumpingOverRims) {
  PathCheck check;
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    Random random(seed, {6});
    const int corners = 64 << (seed % 4);
    const stimuli::PolygonSoup soup =
        seed % 3 ? stimuli::cone(0.05, testing::uniform(random, 0.005, 0.1), corners)
                 : stimuli::cylinder(0.05, testing::uniform(random, 0.005, 0.1), corners);
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(soup);
    const double length = random_length(random, *mesh);
    Bench bench(*GetParam(), mesh);
    ASSERT_EQ(check.follow(bench, testing::jumping_path(random, *mesh, length, 100)), "")
        << "seed " << seed << ", corners " << corners;
  }
}

INSTANTIATE_TEST_SUITE_P(Both, EveryTick, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
