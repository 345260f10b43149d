// Plane, middle, area and diameter of polygons whose measures are known.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "stimuli/face_triangles.h"

namespace palpate::stimuli {
namespace {
namespace polygons {

TEST(PlaneOf, RegularPolygonsOfAnySizeAndOrientation) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int sides = 3; sides < 20; ++sides) {
    const double radius = std::pow(10, 4 * random.unit() - 4);
    const Quat turn =
        glm::normalize(Quat(random.normal(), random.normal(), random.normal(), random.normal()));
    const Vec3 at = radius * Vec3(random.normal(), random.normal(), random.normal());
    std::vector<Vec3> corners;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      corners.push_back(at + turn * (radius * Vec3(std::cos(angle), std::sin(angle), 0)));
    }
    const PolygonPlane plane = plane_of(corners);
    const double area = 0.5 * sides * radius * radius * std::sin(2 * std::numbers::pi / sides);
    EXPECT_NEAR(plane.area, area, 1e-13 * radius * radius);
    EXPECT_LT(glm::length(plane.normal - turn * Vec3(0, 0, 1)), 1e-13);
    EXPECT_LT(glm::length(plane.middle - at), 1e-14 * radius * sides);
    const double longest =
        2 * radius * (sides % 2 == 0 ? 1 : std::cos(std::numbers::pi / (2 * sides)));
    EXPECT_LE(plane.diameter, longest * (1 + 1e-14));
    EXPECT_GE(plane.diameter, longest / 2);
    // Reversed, it has the opposite normal; all else is the same.
    std::reverse(corners.begin(), corners.end());
    EXPECT_LT(glm::length(plane_of(corners).normal + plane.normal), 1e-13);
    EXPECT_NEAR(plane_of(corners).area, area, 1e-13 * radius * radius);
  }
}

TEST(PlaneOf, RectangleIsExact) {
  const std::vector<Vec3> rectangle{{1, 1, 5}, {4, 1, 5}, {4, 5, 5}, {1, 5, 5}};
  const PolygonPlane plane = plane_of(rectangle);
  EXPECT_EQ(plane.normal, Vec3(0, 0, 1));
  EXPECT_EQ(plane.middle, Vec3(2.5, 3, 5));
  EXPECT_NEAR(plane.area, 12, 1e-14);
  EXPECT_NEAR(plane.diameter, 5, 1e-15);
}

/// The far ends of a needle a million times longer than wide stay on its plane, within rounding.
TEST(PlaneOf, ANeedleIsNotTilted) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  for (int round = 0; round < 100; ++round) {
    const Quat turn =
        glm::normalize(Quat(random.normal(), random.normal(), random.normal(), random.normal()));
    const Vec3 at(random.normal(), random.normal(), random.normal());
    std::vector<Vec3> corners;
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1e-6, 0), Vec3(0, 1e-6, 0)})
      corners.push_back(0.01 * (at + turn * corner));
    const PolygonPlane plane = plane_of(corners);
    EXPECT_NEAR(glm::length(plane.normal), 1, 1e-14);
    for (const Vec3& corner : corners)
      EXPECT_NEAR(glm::dot(plane.normal, corner - plane.middle), 0, 2e-17);
    EXPECT_NEAR(plane.area, 1e-10, 1e-19);
  }
}

TEST(PlaneOf, WithoutAreaThereIsNoNormal) {
  const std::vector<Vec3> line{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(plane_of(line).normal, Vec3(0));
  EXPECT_EQ(plane_of(line).area, 0);
  EXPECT_EQ(plane_of(line).diameter, 3);
  const std::vector<Vec3> point(3, Vec3(1, 2, 3));
  EXPECT_EQ(plane_of(point).normal, Vec3(0));
  EXPECT_EQ(plane_of(point).diameter, 0);
  EXPECT_EQ(plane_of(point).middle, Vec3(1, 2, 3));
}

/// Triangles keep their number and turn; the square of 90,000 corners would take minutes.
TEST(FaceTriangles, ManyRepeatedCornersTakeNoSquare) {
  const std::array<Vec3, 3> places{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0)};
  std::vector<Vec3> corners;
  for (int i = 0; i < 90'000; ++i) corners.push_back(places[static_cast<std::size_t>(i) % 3]);
  const auto began = std::chrono::steady_clock::now();
  const auto triangles = face_triangles(corners);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));
  ASSERT_EQ(triangles.size(), corners.size() - 2);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const auto& one : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++sides[{one[k], one[(k + 1) % 3]}];
      --sides[{one[(k + 1) % 3], one[k]}];
    }
  }
  std::size_t at_the_rim = 0;
  for (const auto& [side, count] : sides) {
    if (count <= 0) continue;
    EXPECT_EQ(count, 1);
    EXPECT_EQ(side.second, (side.first + 1) % corners.size());
    ++at_the_rim;
  }
  EXPECT_EQ(at_the_rim, corners.size());
}

}  // namespace polygons
}  // namespace
}  // namespace palpate::stimuli
