#pragma once
// Facets of a convex mesh by direction: where a walk over it begins. Mesh frame, m.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/surfaces/direction_cells.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::rendering {

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
  stimuli::DirectionCells directions_;
  std::vector<std::uint32_t> cells_;
};

}  // namespace palpate::rendering
