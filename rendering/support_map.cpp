#include "rendering/support_map.h"

#include "rendering/separation.h"

namespace palpate::rendering {

SupportMap::SupportMap(const stimuli::ConvexMesh& mesh, std::size_t small_mesh,
                       double vertices_per_cell) {
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

}  // namespace palpate::rendering
