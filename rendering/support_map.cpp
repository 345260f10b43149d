#include "rendering/support_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "rendering/separation.h"

namespace palpate::rendering {
namespace {

/// The index of the cell that coordinate c in [-1, 1] lies in.
int cell_of(double c, int resolution) {
  return std::clamp(static_cast<int>((c + 1) * 0.5 * resolution), 0, resolution - 1);
}

}  // namespace

SupportMap::SupportMap(const stimuli::ConvexMesh& mesh, std::size_t small_mesh,
                       double vertices_per_cell) {
  const std::size_t vertices = mesh.vertices().size();
  if (vertices <= small_mesh) return;
  const double cells = static_cast<double>(vertices) / (6 * vertices_per_cell);
  resolution_ = std::max(1, static_cast<int>(std::sqrt(cells)));
  const auto side = static_cast<std::size_t>(resolution_);
  cells_.resize(6 * side * side);
  std::uint32_t vertex = 0;
  for (std::size_t face = 0; face < 6; ++face) {
    for (std::size_t row = 0; row < side; ++row) {
      for (std::size_t k = 0; k < side; ++k) {
        const std::size_t column = row % 2 == 0 ? k : side - 1 - k;  // the next cell is a neighbour
        Vec3 direction;
        const auto axis = static_cast<int>(face / 2);
        direction[axis] = face % 2 == 0 ? 1 : -1;
        direction[(axis + 1) % 3] = (2.0 * static_cast<double>(row) + 1) / resolution_ - 1;
        direction[(axis + 2) % 3] = (2.0 * static_cast<double>(column) + 1) / resolution_ - 1;
        vertex = support_vertex(mesh, direction, vertex);
        cells_[(face * side + row) * side + column] = vertex;
      }
    }
  }
}

std::uint32_t SupportMap::near_support(const Vec3& direction) const {
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(direction[k]) > std::abs(direction[axis])) axis = k;
  }
  const double scale = 1 / std::abs(direction[axis]);
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  const int row = cell_of(scale * direction[(axis + 1) % 3], resolution_);
  const int column = cell_of(scale * direction[(axis + 2) % 3], resolution_);
  const int cell = (face * resolution_ + row) * resolution_ + column;
  return cells_[static_cast<std::size_t>(cell)];
}

}  // namespace palpate::rendering
