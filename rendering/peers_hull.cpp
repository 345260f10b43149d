#include "rendering/peers_hull.h"

#include <algorithm>
#include <cmath>

namespace palpate::peers {

std::size_t Hull::cell_of(const Vec3& direction) {
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(direction[k]) > std::abs(direction[axis])) axis = k;
  }
  const double most = direction[axis];
  const auto index = [&](double value) {
    const double share = 0.5 + 0.5 * value / std::abs(most);  // NaN for no direction: cell 0
    return share > 0 ? std::min(kCells - 1, static_cast<int>(share * kCells)) : 0;
  };
  const int face = 2 * axis + (most < 0 ? 1 : 0);
  return static_cast<std::size_t>((face * kCells + index(direction[(axis + 1) % 3])) * kCells +
                                  index(direction[(axis + 2) % 3]));
}

Hull::Hull(const ConvexMesh& mesh)
    : mesh_(mesh), scale_(mesh), start_(std::size_t{6} * kCells * kCells) {
  std::uint32_t vertex = 0;
  for (std::size_t cell = 0; cell < start_.size(); ++cell) {
    const auto face = static_cast<int>(cell) / (kCells * kCells);
    const auto row = static_cast<int>(cell) / kCells % kCells;
    const auto column = static_cast<int>(cell) % kCells;
    Vec3 middle;
    middle[face / 2] = face % 2 ? -1 : 1;
    middle[(face / 2 + 1) % 3] = (2 * row + 1.0) / kCells - 1;
    middle[(face / 2 + 2) % 3] = (2 * column + 1.0) / kCells - 1;
    start_[cell] = vertex = support_vertex(mesh, middle, vertex);
  }
}

}  // namespace palpate::peers
