#include "stimuli/parts/cover_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "stimuli/random.h"

namespace palpate::stimuli {
namespace {

constexpr int kPoints = 256;

// m, how far a point is out of a part; negative inside.
double out_of(const ConvexMesh& part, const Vec3& point) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Facet& facet : part.facets())
    most = std::max(most, glm::dot(facet.normal, point) - facet.offset);
  return most;
}

void check_volume(const TriangleSurface& solid, const std::vector<ConvexMesh>& parts, double slack,
                  MeshFaults& faults) {
  const SolidBulk expected = bulk_of(solid);
  double volume = 0;
  for (const ConvexMesh& part : parts) volume += volume_of(part);
  const double off = std::abs(volume - expected.volume);
  if (off <= 1e-9 * expected.volume + slack * expected.area) return;
  faults.add("not covered", [&] {
    char text[160];
    std::snprintf(text, sizeof text,
                  "expected convex parts of %.9g m^3 in all, found %.9g m^3 in %zu parts",
                  expected.volume, volume, parts.size());
    return std::string(text) + "; does the surface pass through itself?";
  });
}

}  // namespace

double volume_of(const ConvexMesh& mesh) {
  double volume = 0;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const Facet& facet = mesh.facets()[f];
    const auto corner = [&](std::uint32_t k) {
      const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
      return (edge.left == f ? edge.from : edge.to) - mesh.centre();
    };
    const Vec3 first = corner(0);
    for (std::uint32_t k = 2; k < facet.side_count; ++k)
      volume += glm::dot(first, glm::cross(corner(k - 1), corner(k))) / 6;
  }
  return volume;
}

void check_cover(const TriangleSurface& solid, const std::vector<ConvexMesh>& parts, double slack,
                 MeshFaults& faults) {
  check_volume(solid, parts, slack, faults);
  Vec3 low = solid[0][0], high = low;
  for (const auto& triangle : solid) {
    for (const Vec3& corner : triangle) {
      low = glm::min(low, corner);
      high = glm::max(high, corner);
    }
  }
  const double near = 1e-6 * glm::length(high - low);  // of a surface: either answer is right
  Random random(1);
  for (int i = 0; i < kPoints; ++i) {
    Vec3 point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = low[axis] + (high[axis] - low[axis]) * random.unit();
    int in = 0;
    bool doubtful = false;
    for (const ConvexMesh& part : parts) {
      const double out = out_of(part, point);
      doubtful |= std::abs(out) < near;
      in += out < 0 ? 1 : 0;
    }
    const double winding = winding_number(solid, point);
    if (doubtful || std::abs(winding - in) < 0.01) continue;
    faults.add("not covered", [&] {
      char text[200];
      std::snprintf(
          text, sizeof text,
          "the point (%.4g, %.4g, %.4g) m lies in %d of the convex parts, but the surface "
          "winds round it %.2f times",
          point.x, point.y, point.z, in, winding);
      return std::string(text);
    });
  }
}

}  // namespace palpate::stimuli
