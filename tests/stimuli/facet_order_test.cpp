// Facets that are close in space are close in memory, whatever the order of the faces.

#include <gtest/gtest.h>

#include <cstddef>
#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "stimuli/random.h"

namespace palpate::stimuli {
namespace {

Vec3 centre_of(const ConvexMesh& mesh, const Facet& facet) {
  Vec3 sum;
  for (std::uint32_t s = 0; s < facet.side_count; ++s) {
    const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + s].edge];
    sum += edge.from + edge.to;
  }
  return sum / (2.0 * facet.side_count);
}

TEST(ConvexMesh, NeighboursInSpaceAreNeighboursInMemory) {
  PolygonSoup soup = icosphere(0.03, 4);
  Random random(3);
  random.shuffle(soup.faces);
  const ConvexMesh mesh(soup);
  const auto& facets = mesh.facets();
  double step = 0, nearest = 0;  // m: means over facets
  for (std::size_t f = 1; f < facets.size(); ++f) {
    const Vec3 here = centre_of(mesh, facets[f]);
    step += glm::length(here - centre_of(mesh, facets[f - 1]));
    const Side& side = mesh.sides()[facets[f].first_side];
    nearest += glm::length(here - centre_of(mesh, facets[side.across]));
  }
  // In random order a step would be as long as the radius, 40 times as far as the next facet.
  EXPECT_LT(step, 4 * nearest);
}

}  // namespace
}  // namespace palpate::stimuli
