#pragma once
// Where walks over a large mesh begin: the facet by which a ray out of its middle leaves it.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/direction_cells.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A cube map of directions with the facet that the middle ray of each cell leaves the mesh by, so
/// that a walk begins a few facets from where it ends, whatever the number of facets. Directions
/// are those of a frame in which the mesh is as wide in all of them (a linear map, from the second
/// moments of its surface): plates and needles are seen as round ones. Small meshes, walked over in
/// few steps anyway, have none. Built in linear time; 4 bytes a cell.
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
  /// To the frame in which the mesh is round, from the middle.
  Vec3 rounded(const Vec3& v) const;

  Vec3 middle_;
  Vec3 row0_, row1_, row2_;  // of the linear map, lower triangular
  DirectionCells directions_;
  std::vector<std::uint32_t> cells_;
};

}  // namespace palpate::rendering
