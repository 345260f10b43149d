#include "stimuli/grid_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/random_polyhedron.h"

namespace palpate::stimuli {
namespace {

double highest_above(const PolygonSoup& soup, const Vec3& point) {
  double most = -std::numeric_limits<double>::max();
  for (const auto& face : soup.faces) {
    const Vec3& a = soup.vertices[face[0]];
    const Vec3 normal =
        glm::normalize(glm::cross(soup.vertices[face[1]] - a, soup.vertices[face[2]] - a));
    most = std::max(most, glm::dot(normal, point - a));
  }
  return most;
}

TEST(GridHull, HoldsEveryPointAndIsClosed) {
  for (const double away : {0.0, 1000.0}) {
    constexpr std::uint64_t kSeed = 5;
    Random random(kSeed);
    std::vector<Vec3> points;
    for (int i = 0; i < 400; ++i) {
      const Vec3 on = uniform_rotation(random) * Vec3(0, 0, 0.03);
      points.push_back(Vec3(away) + (i % 4 == 0 ? random.unit() * on : on));
    }
    const double error = away > 0 ? 1e-11 : 1e-14;
    const GridHull hull = grid_hull(points, error);
    ASSERT_EQ(hull.soup.vertices.size(), 300U);
    EXPECT_EQ(hull.soup.faces.size(), 2 * 300U - 4);  // closed and of one piece: Euler
    for (const Vec3& point : points) {
      EXPECT_LE(highest_above(hull.soup, point), 10 * error + 1e-11);
    }
    EXPECT_GT(hull.depth, 0.02);
  }
}

TEST(GridHull, GivesTheDepthOfPoints) {
  std::vector<Vec3> points;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) points.emplace_back(x, y, z);
    }
  }
  EXPECT_EQ(grid_hull(points, 1e-9).depth, 0);
  EXPECT_EQ(grid_hull(points, 1e-9).soup.faces.size(), 12U);
  points.emplace_back(0.1, 0.2, 0.75);
  EXPECT_NEAR(grid_hull(points, 1e-9).depth, 0.25, 1e-8);
  points.emplace_back(1, 1, 1);  // twice
  points.emplace_back(1, 0, 0);  // in a side
  EXPECT_EQ(grid_hull(points, 1e-9).soup.faces.size(), 12U);
}

TEST(GridHull, FlatPointsHaveNoHull) {
  std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(grid_hull(points, 1e-9).soup.faces.empty());
  points.emplace_back(1, 1, 0);
  points.emplace_back(0.3, 0.4, 0);
  EXPECT_TRUE(grid_hull(points, 1e-9).soup.faces.empty());
  EXPECT_TRUE(grid_hull(std::vector<Vec3>(9, Vec3(1, 2, 3)), 1e-9).soup.faces.empty());
  EXPECT_TRUE(grid_hull({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}}, 1e-9).soup.faces.empty());
}

}  // namespace
}  // namespace palpate::stimuli
