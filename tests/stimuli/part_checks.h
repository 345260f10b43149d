#pragma once
// Measurements of the tests of convex parts.

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <vector>

#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "tests/stimuli/mesh_invariants.h"

namespace palpate::stimuli::checks {

/// Volume by tetrahedra from a point of the mesh, independent of the library's method.
inline double volume(const ConvexMesh& mesh) {
  double six = 0;
  const Vec3 apex = mesh.vertices()[0];
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const auto at = [&](std::uint32_t k) { return mesh.vertices()[corner_of(mesh, f, k)]; };
    for (std::uint32_t k = 2; k < mesh.facets()[f].side_count; ++k)
      six += glm::dot(at(0) - apex, glm::cross(at(k - 1) - apex, at(k) - apex));
  }
  return six / 6;
}

inline double volume(const std::vector<ConvexMesh>& parts) {
  double sum = 0;
  for (const ConvexMesh& part : parts) sum += volume(part);
  return sum;
}

/// m, distance of a point from a part; negative inside.
inline double out_of(const ConvexMesh& mesh, const Vec3& point) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Facet& facet : mesh.facets())
    most = std::max(most, glm::dot(facet.normal, point) - facet.offset);
  return most;
}

/// The message that refuses a solid.
inline std::string refusal(const PolygonSoup& soup) {
  try {
    return "taken, in " + std::to_string(convex_parts(soup).size()) + " parts";
  } catch (const MeshError& error) {
    return error.what();
  }
}

}  // namespace palpate::stimuli::checks
