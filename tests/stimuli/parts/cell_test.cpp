// Convex cells cut by planes: volumes, areas and closed surfaces, by closed forms and by property.

#include "stimuli/parts/cell.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <map>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "tests/shared/rounds.h"

namespace palpate::stimuli {
namespace {
namespace cells {

constexpr double kTolerance = 1e-9;
const Vec3 kLow(-0.01, -0.02, -0.03), kHigh(0.03, 0.01, 0.02);  // 0.04 x 0.03 x 0.05 m

Vec3 outward_of(const CellPolygon& face, const PlaneTable& planes) {
  return (face.on.flipped ? -1.0 : 1.0) * planes[face.on.plane].normal;
}

Vec3 twice_area_of(const CellPolygon& face) {
  Vec3 sum;
  for (std::size_t k = 0; k < face.corners.size(); ++k)
    sum += glm::cross(face.corners[k], face.corners[(k + 1) % face.corners.size()]);
  return sum;
}

/// Faces lie in their planes with the right orientation and without repeated corners, and each side
/// of a face is the reversed side of one other face, to the bit.
void expect_closed(const Cell& cell, const PlaneTable& planes) {
  std::map<std::array<double, 6>, int> sides;
  const auto side = [](const Vec3& a, const Vec3& b) {
    return std::array{a.x, a.y, a.z, b.x, b.y, b.z};
  };
  for (const CellPolygon& face : cell.faces) {
    ASSERT_GE(face.corners.size(), 3U);
    EXPECT_GT(glm::dot(twice_area_of(face), outward_of(face, planes)), 0);
    for (std::size_t k = 0; k < face.corners.size(); ++k) {
      EXPECT_LE(std::abs(planes[face.on.plane].height(face.corners[k])), kTolerance);
      for (std::size_t j = 0; j < k; ++j) EXPECT_NE(face.corners[j], face.corners[k]);
      ++sides[side(face.corners[k], face.corners[(k + 1) % face.corners.size()])];
    }
  }
  for (const auto& [at, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(sides.count({at[3], at[4], at[5], at[0], at[1], at[2]}), 1U);
  }
}

TEST(Cell, BoxHasItsMeasures) {
  PlaneTable planes(kTolerance);
  const Cell cell = box_cell(kLow, kHigh, planes);
  EXPECT_FALSE(cell.empty());
  EXPECT_TRUE(Cell().empty());
  ASSERT_EQ(cell.faces.size(), 6U);
  EXPECT_EQ(planes.size(), 6U);
  expect_closed(cell, planes);
  const CellBulk bulk = bulk_of(cell.faces);
  EXPECT_NEAR(bulk.volume, 0.04 * 0.03 * 0.05, 1e-18);
  EXPECT_NEAR(bulk.area, 2 * (0.04 * 0.03 + 0.03 * 0.05 + 0.05 * 0.04), 1e-16);
  EXPECT_LT(glm::length(bulk.middle - 0.5 * (kLow + kHigh)), 1e-16);
  EXPECT_EQ(bulk_of(Cell().faces).volume, 0);
  EXPECT_EQ(bulk_of(Cell().faces).area, 0);
}

/// The mean of all faces' corners, each weighted by the number of faces that meet there.
TEST(Cell, PyramidsMiddleIsItsFacesCornersMean) {
  const Vec3 a(0, 0, 0), b(2, 0, 0), c(2, 2, 0), d(0, 2, 0), top(1, 1, 3), off(5, 6, 7);
  std::vector<CellPolygon> faces{{{d, c, b, a}, {}},
                                 {{a, b, top}, {}},
                                 {{b, c, top}, {}},
                                 {{c, d, top}, {}},
                                 {{d, a, top}, {}}};
  for (CellPolygon& face : faces) {
    for (Vec3& corner : face.corners) corner += off;
  }
  const CellBulk bulk = bulk_of(faces);
  EXPECT_NEAR(bulk.volume, 4, 1e-12);
  EXPECT_NEAR(bulk.area, 4 + 4 * std::sqrt(10.0), 1e-12);
  // 16 corners: each of the base's 3 times, the top 4 times.
  EXPECT_LT(glm::length(bulk.middle - (off + Vec3(1, 1, 12.0 / 16))), 1e-12);
}

TEST(Cell, IsCutAcrossWhereThePlaneIs) {
  PlaneTable planes(kTolerance);
  Cell cell = box_cell(kLow, kHigh, planes);
  const std::vector<Vec3> square{{0, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
  const std::uint32_t across = planes.number({Vec3(-1, 0, 0), 0}, square).plane;
  ASSERT_EQ(across, 6U);
  const CutCell halves = cut(std::move(cell), across, planes);
  // Below -x <= 0 is where x is positive.
  EXPECT_NEAR(bulk_of(halves.below.faces).volume, 0.03 * 0.03 * 0.05, 1e-18);
  EXPECT_NEAR(bulk_of(halves.above.faces).volume, 0.01 * 0.03 * 0.05, 1e-18);
  for (const Cell* half : {&halves.below, &halves.above}) {
    ASSERT_EQ(half->faces.size(), 6U);
    expect_closed(*half, planes);
    const CellPolygon& cap = half->faces.back();
    EXPECT_EQ(cap.on.plane, across);
    EXPECT_EQ(cap.on.flipped, half == &halves.above);
    EXPECT_EQ(cap.corners.size(), 4U);
  }
}

/// Corners of a cut that other faces share stay single: a cube cut through four of its edges, and
/// through three corners.
TEST(Cell, IsCutThroughItsCorners) {
  for (const bool corner : {false, true}) {
    PlaneTable planes(kTolerance);
    Cell cell = box_cell(Vec3(0), Vec3(1), planes);
    const std::vector<Vec3> points = corner ? std::vector<Vec3>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}
                                            : std::vector<Vec3>{{1, 0, 0}, {0, 1, 0}, {0, 1, 1}};
    const Vec3 normal = glm::normalize(corner ? Vec3(1, 1, 1) : Vec3(1, 1, 0));
    const std::uint32_t through =
        planes.number({normal, glm::dot(normal, points[0])}, points).plane;
    const CutCell halves = cut(std::move(cell), through, planes);
    EXPECT_NEAR(bulk_of(halves.below.faces).volume, corner ? 1.0 / 6 : 0.5, 1e-15);
    EXPECT_NEAR(bulk_of(halves.above.faces).volume, corner ? 5.0 / 6 : 0.5, 1e-15);
    EXPECT_EQ(halves.below.faces.back().corners.size(), points.size() + (corner ? 0 : 1));
    EXPECT_EQ(halves.below.faces.size(), corner ? 4U : 5U);
    EXPECT_EQ(halves.above.faces.size(), corner ? 7U : 5U);
    expect_closed(halves.below, planes);
    expect_closed(halves.above, planes);
  }
}

TEST(Cell, StaysClosedHoweverOftenItIsCut) {
  constexpr std::uint64_t kSeed = 41;
  Random random(kSeed);
  const auto vector = [&random] { return Vec3(random.normal(), random.normal(), random.normal()); };
  for (int round = 0; round < testing::rounds(30); ++round) {
    PlaneTable planes(kTolerance);
    std::vector<Cell> cells{box_cell(kLow, kHigh, planes)};
    for (int cuts = 0; cuts < 6; ++cuts) {
      const Vec3 normal = glm::normalize(vector());
      const double offset = glm::dot(normal, 0.008 * vector());
      const Vec3 u = glm::normalize(glm::cross(normal, vector())), v = glm::cross(normal, u);
      const Vec3 on = offset * normal;
      const std::uint32_t plane =
          planes.number({normal, offset}, std::array{on, on + u, on + v}).plane;
      std::vector<Cell> parts;
      for (Cell& cell : cells) {
        const double whole = bulk_of(cell.faces).volume;
        CutCell halves = cut(std::move(cell), plane, planes);
        const double below = bulk_of(halves.below.faces).volume;
        const double above = bulk_of(halves.above.faces).volume;
        EXPECT_NEAR(below + above, whole, 1e-14 * 6e-5);
        for (const Cell* half : {&halves.below, &halves.above}) {
          if (half->empty()) continue;
          EXPECT_GT(bulk_of(half->faces).volume, 0);
          expect_closed(*half, planes);
          for (const CellPolygon& face : half->faces) {
            for (const Vec3& corner : face.corners) {
              const double height = planes[plane].height(corner);
              EXPECT_LE(half == &halves.below ? height : -height, kTolerance);
            }
          }
        }
        if (!halves.below.empty()) parts.push_back(std::move(halves.below));
        if (!halves.above.empty()) parts.push_back(std::move(halves.above));
      }
      cells = std::move(parts);
    }
    EXPECT_GT(cells.size(), 6U);
  }
}

/// A plane inside a face by at most the tolerance leaves the cell whole; slightly more cuts off a
/// slice.
TEST(Cell, PlanesWithinTheToleranceLeaveItWhole) {
  for (const double inside : {-1.0, 0.0, 0.9, 1.1}) {
    for (const double side : {-1.0, 1.0}) {
      PlaneTable planes(kTolerance);
      Cell cell = box_cell(Vec3(-0.01), Vec3(0.01), planes);
      cell.surface.push_back({{{0, 0, 0}, {0.001, 0, 0}, {0, 0.001, 0}}, {0, false}});
      const Vec3 on(side * (0.01 - inside * kTolerance), 0, 0);
      // Not by number(), which would give the face's own plane.
      PlaneTable two(kTolerance);
      for (std::uint32_t i = 0; i < planes.size(); ++i) {
        const Vec3 n = planes[i].normal, far = 0.01 * n;
        two.number(planes[i],
                   std::array{far, far + Vec3(n.y, n.z, n.x), far + Vec3(n.z, n.x, n.y)});
      }
      const std::uint32_t plane =
          two.number({Vec3(1, 0, 0), on.x},
                     std::array{on + Vec3(0, 1, 0), on + Vec3(0, 0, 1), on + Vec3(1, 0, 0)})
              .plane;
      ASSERT_EQ(plane, 6U);
      const CutCell halves = cut(std::move(cell), plane, two);
      const Cell& large = side > 0 ? halves.below : halves.above;
      const Cell& small = side > 0 ? halves.above : halves.below;
      EXPECT_EQ(small.empty(), inside < 1) << inside;
      EXPECT_EQ(large.faces.size(), 6U);
      EXPECT_EQ(large.surface.size(), 1U);
      EXPECT_TRUE(small.surface.empty());
    }
  }
}

TEST(Cell, SurfaceStaysOnItsSideUnlessInPlane) {
  PlaneTable planes(kTolerance);
  Cell cell = box_cell(Vec3(-1), Vec3(1), planes);
  const std::uint32_t cutting =
      planes.number({Vec3(0, 0, 1), 0}, std::array{Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0)}).plane;
  const PlaneSide other{77, true};
  const auto triangle = [](double z0, double z1) {
    return std::vector<Vec3>{{0, 0, z0}, {0.5, 0, z1}, {0, 0.5, z1}};
  };
  cell.surface = {{triangle(0.1, 0.2), other},
                  {triangle(-0.1, -0.2), other},
                  {triangle(0, 0), other},               // in the plane
                  {triangle(0, 0.3), {cutting, false}},  // by its number
                  {triangle(-0.25, 0.75), other},        // across
                  {triangle(0, 0.5), other}};            // touches
  const CutCell halves = cut(std::move(cell), cutting, planes);
  ASSERT_EQ(halves.above.surface.size(), 3U);
  ASSERT_EQ(halves.below.surface.size(), 2U);
  EXPECT_EQ(halves.above.surface[0].corners, triangle(0.1, 0.2));
  EXPECT_EQ(halves.above.surface[2].corners, triangle(0, 0.5));
  EXPECT_EQ(halves.below.surface[0].corners, triangle(-0.1, -0.2));
  // A quarter of the length along both rising sides.
  const CellPolygon &lower = halves.below.surface[1], &upper = halves.above.surface[1];
  EXPECT_EQ(lower.corners, (std::vector<Vec3>{{0, 0, -0.25}, {0.125, 0, 0}, {0, 0.125, 0}}));
  EXPECT_EQ(upper.corners,
            (std::vector<Vec3>{{0.125, 0, 0}, {0.5, 0, 0.75}, {0, 0.5, 0.75}, {0, 0.125, 0}}));
  for (const CellPolygon* piece : {&lower, &upper}) {
    EXPECT_EQ(piece->on.plane, 77U);
    EXPECT_TRUE(piece->on.flipped);
  }
}

TEST(PlaneTable, NumbersAPlaneOnceFromEitherSide) {
  PlaneTable planes(1e-6);
  EXPECT_EQ(planes.tolerance(), 1e-6);
  const std::vector<Vec3> points{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}};
  const Plane up{Vec3(0, 0, 1), 2}, down{Vec3(0, 0, -1), -2};
  const PlaneSide first = planes.number(up, points), again = planes.number(up, points);
  const PlaneSide back = planes.number(down, points);
  EXPECT_EQ(first.plane, 0U);
  EXPECT_FALSE(first.flipped);
  EXPECT_EQ(again.plane, 0U);
  EXPECT_FALSE(again.flipped);
  EXPECT_EQ(back.plane, 0U);
  EXPECT_TRUE(back.flipped);
  EXPECT_EQ(planes.size(), 1U);
  // A point slightly farther off than the tolerance makes it another plane.
  for (const double off : {0.9e-6, -0.9e-6, 1.1e-6, -1.1e-6}) {
    std::vector<Vec3> moved = points;
    moved[2].z += off;
    PlaneTable table(1e-6);
    table.number(up, points);
    const PlaneSide side = table.number({Vec3(0, 0, 1), 2 + off / 3}, moved);
    EXPECT_EQ(side.plane, std::abs(off) > 1e-6 ? 1U : 0U) << off;
    EXPECT_FALSE(side.flipped);
    EXPECT_EQ(table.size(), std::abs(off) > 1e-6 ? 2U : 1U);
  }
  // Corners of a small polygon lie on the plane, but its normal differs.
  const std::vector<Vec3> small{{0, 0, 2}, {1e-7, 0, 2}, {0, 0, 2 + 1e-7}};
  EXPECT_EQ(planes.number({Vec3(0, -1, 0), 0}, small).plane, 1U);
  EXPECT_EQ(planes[1].normal, Vec3(0, -1, 0));
  EXPECT_EQ(planes[0].height(Vec3(5, 6, 9)), 7);
  // 0.99 is the cosine of 8.1 degrees.
  for (const double degrees : {8.0, 8.2, 172.0, 171.8}) {
    const double angle = degrees * 3.14159265358979 / 180;
    PlaneTable table(1e-6);
    table.number(up, points);
    const bool same = degrees == 8 || degrees == 172;
    const std::vector<Vec3> tiny{{0, 0, 2}, {1e-7, 0, 2}, {0, 1e-7, 2}};
    EXPECT_EQ(table.number({Vec3(std::sin(angle), 0, std::cos(angle)), 0}, tiny).plane,
              same ? 0U : 1U)
        << degrees;
  }
}

}  // namespace cells
}  // namespace
}  // namespace palpate::stimuli
