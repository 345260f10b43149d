// Local penetration depths in a polyhedron, by visiting all its facets and edges.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/accuracy/local_depths_collector.h"

namespace palpate::rendering {

std::vector<LocalDepth> local_depths(const stimuli::ConvexMesh& mesh, const LineProbe& probe,
                                     const Vec3& towards, double angle) {
  const double least_cosine = angle < std::numbers::pi ? std::cos(angle) : -2;
  const double slack = 1e-12 * mesh.size();
  const Vec3 d = probe.tail - probe.tip;
  const double length = glm::length(d);
  const Vec3 u = length > 0 ? d / length : Vec3();
  const auto flatness = [&](const stimuli::Facet& facet) {
    return length > 0 ? depths::angle_to_plane(u, facet.normal) : depths::kRightAngle;
  };
  std::vector<LocalDepth> found;
  for (const stimuli::Facet& facet : mesh.facets()) {
    if (glm::dot(facet.normal, towards) < least_cosine) continue;
    const bool tail = glm::dot(facet.normal, d) < 0;
    const Vec3& end = tail ? probe.tail : probe.tip;
    const double depth = facet.offset - glm::dot(facet.normal, end);
    if (depth < 0) return {};  // a plane between them
    const Vec3 foot = end + depth * facet.normal;
    bool over = true;
    for (std::uint32_t i = 0; over && i < facet.side_count; ++i) {
      const stimuli::Side& side = mesh.sides()[facet.first_side + i];
      over = glm::dot(side.inward, foot) >= side.offset - slack;
    }
    if (over) found.push_back({facet.normal, depth, tail ? 1.0 : 0.0, flatness(facet)});
  }
  for (const stimuli::Edge& edge : mesh.edges()) {
    const stimuli::Facet &left = mesh.facets()[edge.left], &right = mesh.facets()[edge.right];
    const double left_slope = glm::dot(left.normal, d), right_slope = glm::dot(right.normal, d);
    if ((left_slope >= 0) == (right_slope >= 0)) continue;
    // At right angles to the probe, between the normals of the edge's two faces.
    const Vec3 n =
        glm::normalize(std::abs(right_slope) * left.normal + std::abs(left_slope) * right.normal);
    if (glm::dot(n, towards) < least_cosine) continue;
    const Vec3& v0 = edge.from;
    const Vec3 line = edge.to - v0;
    const Vec3 c = glm::cross(line, d);
    const double c2 = glm::dot(c, c);
    if (c2 <= 1e-18 * glm::dot(line, line) * length * length) continue;  // no width
    const double depth = glm::dot(n, v0 - probe.tip);
    if (depth < 0) return {};
    const Vec3 w = probe.tip + depth * n - v0;
    const double along = glm::dot(glm::cross(w, d), c) / c2;
    const double fraction = glm::dot(glm::cross(w, line), c) / c2;
    const double beyond_edge = slack / glm::length(line), beyond_end = slack / length;
    if (along < -beyond_edge || along > 1 + beyond_edge) continue;
    if (fraction < -beyond_end || fraction > 1 + beyond_end) continue;
    found.push_back(
        {n, depth, std::clamp(fraction, 0.0, 1.0), std::min(flatness(left), flatness(right))});
  }
  depths::sort_by_depth(found);
  return found;
}

}  // namespace palpate::rendering
