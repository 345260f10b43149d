// Convex cells that share a plane become one where their union is convex.

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "stimuli/parts/convex_sets.h"

namespace palpate::stimuli {
namespace {

using Faces = std::vector<CellPolygon>;

/// The two halves of a box of 2 x 1 x 1 m, and the table of their planes.
std::pair<Faces, Faces> halves_of_a_box(PlaneTable& planes) {
  Cell whole = box_cell({0, 0, 0}, {2, 1, 1}, planes);
  const Vec3 across[] = {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}};
  Plane plane;
  plane.normal = Vec3(1, 0, 0);
  plane.offset = 1;
  CutCell halves = cut(std::move(whole), planes.number(plane, across).plane, planes);
  return {halves.below.faces, halves.above.faces};
}

TEST(MergeConvexNeighbours, HalvesBecomeTheBoxInAnyFaceOrder) {
  PlaneTable planes(1e-9);
  auto [below, above] = halves_of_a_box(planes);
  ASSERT_EQ(below.size(), 6U);
  for (std::size_t turn = 0; turn < 6; ++turn) {
    std::rotate(below.begin(), below.begin() + 1, below.end());
    std::rotate(above.begin(), above.begin() + (turn % 2 == 0 ? 1 : 2), above.end());
    std::vector<Faces> parts = {below, above};
    merge_convex_neighbours(parts, planes);
    ASSERT_EQ(parts.size(), 1U) << turn;
    EXPECT_EQ(parts[0].size(), 6U);
    for (const CellPolygon& face : parts[0]) EXPECT_EQ(face.corners.size(), 4U);
    EXPECT_NEAR(bulk_of(parts[0]).volume, 2, 1e-12);
    EXPECT_NEAR(bulk_of(parts[0]).area, 10, 1e-12);
  }
}

TEST(MergeConvexNeighbours, AConcaveUnionStaysApart) {
  PlaneTable planes(1e-9);
  const Faces low = box_cell({0, 0, 0}, {2, 1, 1}, planes).faces;
  const Faces tower = box_cell({0, 0, 1}, {1, 1, 2}, planes).faces;
  std::vector<Faces> parts = {low, tower};
  merge_convex_neighbours(parts, planes);
  EXPECT_EQ(parts.size(), 2U);
}

}  // namespace
}  // namespace palpate::stimuli
