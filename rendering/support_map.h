#pragma once
// Where hill climbing for the support function (separation.h) begins on a large mesh.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/direction_cells.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A cube map of directions with the support vertex of each cell's middle, so that a climb takes a
/// few steps whatever the number of vertices. Small meshes, climbed in few steps anyway, have none.
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

}  // namespace palpate::rendering
