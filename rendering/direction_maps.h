#pragma once
// Directions divided into cells, as a cube map, and a mesh's maps by direction: the starts of
// searches for its support and its facets.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::rendering {

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

/// The start of hill climbing for the support function (separation.h) on a large mesh.
/// A cube map of directions with the support vertex of each cell's middle, so that a climb takes a
/// few steps for any number of vertices. Small meshes need few steps anyway and have no map.
class SupportMap {
 public:
  static constexpr std::size_t kSmallMesh = 2048;  ///< vertices; a mesh of up to so many has no map

  /// \param small_mesh         up to so many vertices get no map
  /// \param vertices_per_cell  on average; fewer make a finer map
  explicit SupportMap(const stimuli::ConvexMesh& mesh, std::size_t small_mesh = kSmallMesh,
                      double vertices_per_cell = 8);

  bool empty() const { return cells_.empty(); }
  /// A vertex near the one farthest along `direction` (any length but 0). The map must not be
  /// empty.
  std::uint32_t near_support(const Vec3& direction) const;

 private:
  DirectionCells directions_;
  std::vector<std::uint32_t> cells_;
};

/// The start of walks over a large mesh: the facet by which a ray from its middle leaves it.
/// A cube map of directions with the facet by which each cell's middle ray leaves the mesh, so that
/// a walk begins a few facets from its end for any number of facets. Directions are those of a
/// frame in which the mesh is equally wide in all directions (a linear map, from the second moments
/// of its surface): there, plates and needles are round. Small meshes need few steps anyway and
/// have no map. Built in linear time; 4 bytes a cell.
class FacetMap {
 public:
  /// \param small_mesh       up to so many vertices get no map
  /// \param facets_per_cell  on average; fewer make a finer map
  explicit FacetMap(const stimuli::ConvexMesh& mesh, std::size_t small_mesh,
                    double facets_per_cell = 4);

  bool empty() const { return cells_.empty(); }
  /// A facet under the point of the segment tip .. tip + d that is nearest to the middle, m. The
  /// map must not be empty.
  std::uint32_t facet_under(const Vec3& tip, const Vec3& d) const;
  /// The same for a point.
  std::uint32_t facet_under(const Vec3& p) const;

 private:
  /// Maps to the frame in which the mesh is round, from the middle.
  Vec3 rounded(const Vec3& v) const;

  Vec3 middle_;
  Vec3 row0_, row1_, row2_;  // of the linear map, lower triangular
  DirectionCells directions_;
  std::vector<std::uint32_t> cells_;
};

}  // namespace palpate::rendering
