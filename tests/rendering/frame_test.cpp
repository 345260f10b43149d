// Rotating and moving object and probe together rotates the forces and changes nothing else.

#include <gtest/gtest.h>

#include "stimuli/convex_mesh.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;

/// Follows the path at two places; the forces may differ by `tolerance` of the object's size in
/// depth, the torques by as much in lever.
void compare(const Renderer& renderer, const std::shared_ptr<const stimuli::ConvexMesh>& mesh,
             const testing::ProbePath& path, const Pose& there, double tolerance, int& in_contact) {
  Bench home(renderer, mesh);
  Bench away(renderer, mesh, there);
  const double length_error = tolerance * mesh->size();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Rendering a = home.tick(path[i]);
    const LineProbe probe = testing::to_world(there, path[i]);
    const Rendering b = away.tick(probe);
    const double depth_error = 1e-9 * a.deepest.depth + length_error;
    // Where the difference of frames decides whether they touch, the force is close to zero.
    ASSERT_LE(std::abs(a.deepest.depth - b.deepest.depth), depth_error) << "tick " << i;
    ASSERT_LE(glm::length(there.orientation * a.force - b.force),
              2 * home.stiffness() * depth_error)
        << "tick " << i;
    const double reach = mesh->size() + glm::length(path[i].tail - path[i].tip);
    ASSERT_LE(glm::length(there.orientation * a.torque - b.torque),
              2 * home.stiffness() * (depth_error * reach + length_error * a.deepest.depth))
        << "tick " << i;
    if (a.contacts && b.contacts) {
      ++in_contact;
      ASSERT_EQ(a.deepest.type, b.deepest.type) << "tick " << i;
    }
  }
}

class Frames : public ::testing::TestWithParam<const Renderer*> {};

TEST_P(Frames, NearTheOrigin) {
  int in_contact = 0;
  for (std::uint64_t seed = 0; seed < 100 && !HasFatalFailure(); ++seed) {
    Random random(seed, {31});
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(testing::random_convex_mesh(random));
    const double length = mesh->size() * testing::uniform(random, 0.2, 3);
    const auto path = seed % 2 ? testing::wandering_path(random, *mesh, length, 300, 0.01)
                               : testing::sliding_path(random, *mesh, length, 200, 0.01, 0.3,
                                                       GetParam()->side_contact());
    SCOPED_TRACE("seed " + std::to_string(seed));
    compare(*GetParam(), mesh, path, testing::random_pose(random, 2 * mesh->size()), 1e-12,
            in_contact);
  }
  EXPECT_GT(in_contact, 3000);
}

TEST_P(Frames, AKilometreAway) {
  int in_contact = 0;
  for (std::uint64_t seed = 0; seed < 50 && !HasFatalFailure(); ++seed) {
    Random random(seed, {32});
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(
        testing::placed(testing::random_polyhedron(random, 20, Vec3(0.05, 0.04, 0.03)),
                        Quat(1, 0, 0, 0), 1, Vec3()));
    const auto path =
        testing::sliding_path(random, *mesh, 0.12, 200, 0.01, 0.3, GetParam()->side_contact());
    SCOPED_TRACE("seed " + std::to_string(seed));
    // Coordinates there are multiples of 1e-13 m.
    compare(*GetParam(), mesh, path, testing::random_pose(random, 1000), 3e-11, in_contact);
  }
  EXPECT_GT(in_contact, 1000);
}

INSTANTIATE_TEST_SUITE_P(Both, Frames, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

}  // namespace
}  // namespace palpate::rendering
