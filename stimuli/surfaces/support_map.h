#pragma once
// The support function of a convex mesh. Mesh frame, m.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/surfaces/direction_cells.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

class ConvexMesh;

/// Support function of the mesh: the vertex farthest along `direction`, by hill climbing from
/// `start`. Exact on a convex mesh.
std::uint32_t support_vertex(const ConvexMesh& mesh, const Vec3& direction, std::uint32_t start);

/// The start of hill climbing for the support function on a large mesh.
/// A cube map of directions with the support vertex of each cell's middle, so that a climb takes a
/// few steps for any number of vertices. Small meshes need few steps anyway and have no map.
class SupportMap {
 public:
  static constexpr std::size_t kSmallMesh = 2048;  ///< vertices; a mesh of up to so many has no map

  /// \param small_mesh         up to so many vertices get no map
  /// \param vertices_per_cell  on average; fewer make a finer map
  explicit SupportMap(const ConvexMesh& mesh, std::size_t small_mesh = kSmallMesh,
                      double vertices_per_cell = 8);

  bool empty() const { return cells_.empty(); }
  /// A vertex near the one farthest along `direction` (any length but 0). The map must not be
  /// empty.
  std::uint32_t near_support(const Vec3& direction) const;

 private:
  DirectionCells directions_;
  std::vector<std::uint32_t> cells_;
};

}  // namespace palpate::stimuli
