#include "rendering/verification/entry_feature.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace palpate::rendering {

bool separated_by_facet_plane(const stimuli::ConvexMesh& mesh, const LineProbe& before,
                              const LineProbe& after) {
  return std::any_of(mesh.facets().begin(), mesh.facets().end(), [&](const stimuli::Facet& facet) {
    return std::min({glm::dot(facet.normal, before.tip), glm::dot(facet.normal, before.tail),
                     glm::dot(facet.normal, after.tip), glm::dot(facet.normal, after.tail)}) >
           facet.offset;
  });
}

std::optional<ReferenceDepth> measure_feature(const stimuli::ConvexMesh& mesh, bool is_edge,
                                              std::uint32_t i, const LineProbe& probe) {
  if (!is_edge) {
    const stimuli::Facet& facet = mesh.facets()[i];
    return ReferenceDepth{facet.offset - std::min(glm::dot(facet.normal, probe.tip),
                                                  glm::dot(facet.normal, probe.tail)),
                          facet.normal};
  }
  const stimuli::Edge& edge = mesh.edges()[i];
  const Vec3 &left = mesh.facets()[edge.left].normal, &right = mesh.facets()[edge.right].normal;
  const Vec3 d = probe.tail - probe.tip;
  const double left_slope = glm::dot(left, d), right_slope = glm::dot(right, d);
  if ((left_slope >= 0) == (right_slope >= 0)) return std::nullopt;
  const Vec3 normal = glm::normalize(std::abs(right_slope) * left + std::abs(left_slope) * right);
  return ReferenceDepth{glm::dot(normal, edge.from - probe.tip), normal};
}

std::optional<EntryFeature> entry_feature(const stimuli::ConvexMesh& mesh, const LineProbe& probe) {
  std::optional<EntryFeature> best;
  double least = std::numeric_limits<double>::infinity(), second = least;
  const auto consider = [&](bool is_edge, std::uint32_t i) {
    const auto at = measure_feature(mesh, is_edge, i, probe);
    if (!at) return;
    second = std::min(second, std::max(at->depth, least));
    if (at->depth < least) {
      second = least;
      least = at->depth;
      best = EntryFeature{is_edge, i};
    }
  };
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i) consider(false, i);
  for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) consider(true, i);
  // Where another depth is this near, rounding decides.
  if (second - least < kNeighbouringDepths * mesh.size()) return std::nullopt;
  return best;
}

}  // namespace palpate::rendering
