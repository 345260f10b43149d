#pragma once
// Directions divided into cells, as a cube map.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// The faces of a cube about the origin, each cut into resolution x resolution squares.
class DirectionCells {
 public:
  /// \param approximate number of cells in total
  static DirectionCells about(double cells) {
    return DirectionCells(std::max(1, static_cast<int>(std::sqrt(cells / 6))));
  }
  DirectionCells() = default;
  explicit DirectionCells(int resolution) : resolution_(resolution) {}

  std::size_t count() const {
    return 6 * static_cast<std::size_t>(resolution_) * static_cast<std::size_t>(resolution_);
  }

  /// \param direction  any length; for 0 or an infinite one, any cell
  std::size_t cell_of(const Vec3& direction) const {
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
      if (std::abs(direction[k]) > std::abs(direction[axis])) axis = k;
    }
    if (!(std::abs(direction[axis]) > 0)) return 0;
    const double scale = 1 / std::abs(direction[axis]);
    const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
    const int row = square_of(scale * direction[(axis + 1) % 3]);
    const int column = square_of(scale * direction[(axis + 2) % 3]);
    return cell(face, row, column);
  }

  /// Calls visit(cell, its middle), mostly from neighbour to neighbour.
  template <class Visit>
  void visit_middles(const Visit& visit) const {
    for (int face = 0; face < 6; ++face) {
      for (int row = 0; row < resolution_; ++row) {
        for (int k = 0; k < resolution_; ++k) {
          const int column = row % 2 == 0 ? k : resolution_ - 1 - k;
          Vec3 middle;
          const int axis = face / 2;
          middle[axis] = face % 2 == 0 ? 1 : -1;
          middle[(axis + 1) % 3] = (2.0 * row + 1) / resolution_ - 1;
          middle[(axis + 2) % 3] = (2.0 * column + 1) / resolution_ - 1;
          visit(cell(face, row, column), middle);
        }
      }
    }
  }

 private:
  /// The square along a side that contains coordinate c in [-1, 1]; some square if c is NaN.
  int square_of(double c) const {
    return static_cast<int>(
        std::min(std::max(0.0, (c + 1) * 0.5 * resolution_), resolution_ - 1.0));
  }

  std::size_t cell(int face, int row, int column) const {
    const auto side = static_cast<std::size_t>(resolution_);
    return (static_cast<std::size_t>(face) * side + static_cast<std::size_t>(row)) * side +
           static_cast<std::size_t>(column);
  }

  int resolution_ = 0;
};

}  // namespace palpate::stimuli
