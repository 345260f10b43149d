#include "stimuli/surfaces/support_map.h"

#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

std::uint32_t support_vertex(const ConvexMesh& mesh, const Vec3& direction, std::uint32_t start) {
  std::uint32_t best = start;
  double height = glm::dot(direction, mesh.vertices()[best]);
  for (bool climbing = true; climbing;) {
    climbing = false;
    const std::uint32_t from = best;
    for (std::uint32_t i = mesh.fan_first()[from]; i < mesh.fan_first()[from + 1]; ++i) {
      const Edge& edge = mesh.edges()[mesh.fan_edges()[i]];
      const std::uint32_t neighbour = edge.v0 == from ? edge.v1 : edge.v0;
      const double h = glm::dot(direction, mesh.vertices()[neighbour]);
      if (h > height) {
        height = h;
        best = neighbour;
        climbing = true;
      }
    }
  }
  return best;
}

SupportMap::SupportMap(const ConvexMesh& mesh, std::size_t small_mesh, double vertices_per_cell) {
  if (mesh.vertices().size() <= small_mesh) return;
  directions_ =
      DirectionCells::about(static_cast<double>(mesh.vertices().size()) / vertices_per_cell);
  cells_.resize(directions_.count());
  std::uint32_t vertex = 0;
  directions_.visit_middles([&](std::size_t cell, const Vec3& direction) {
    vertex = support_vertex(mesh, direction, vertex);
    cells_[cell] = vertex;
  });
}

std::uint32_t SupportMap::near_support(const Vec3& direction) const {
  return cells_[directions_.cell_of(direction)];
}

}  // namespace palpate::stimuli
