// Faces in one plane are one region, numbered in the order of the faces.

#include "stimuli/coplanar.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"

namespace palpate::stimuli {
namespace {

TEST(CoplanarRegions, AreNumberedInOrderOfTheirFirstFaces) {
  // Sides of unequal area: regions grow from the largest, but are not numbered so.
  PolygonSoup soup = testing::triangulated(box(Vec3(0.01, 0.02, 0.04)));
  for (std::size_t turn = 0; turn < soup.faces.size(); ++turn) {
    std::rotate(soup.faces.begin(), soup.faces.begin() + 5, soup.faces.end());
    MeshFaults faults;
    const HalfEdges mesh = link_half_edges(soup, faults);
    const std::vector<FaceShape> shapes = shapes_of(mesh);
    HalfEdges::Index count = 0;
    const std::vector<HalfEdges::Index> regions = coplanar_regions(mesh, shapes, count);
    EXPECT_EQ(count, 6U);
    HalfEdges::Index next = 0;
    for (const HalfEdges::Index region : regions) {
      EXPECT_LE(region, next);
      next = std::max(next, region + 1);
    }
    EXPECT_EQ(next, count);
  }
}

}  // namespace
}  // namespace palpate::stimuli
