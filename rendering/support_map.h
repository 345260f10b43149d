#pragma once
// Where to begin climbing for the vertex farthest along a direction.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A cube of directions with the farthest vertex of each cell's middle, so that a climb takes a few
/// steps whatever the number of vertices. Meshes that are climbed in few steps anyway have none.
class SupportMap {
 public:
  static constexpr std::size_t kClimbed = 2048;  ///< vertices; so few are climbed as they are

  /// \param climbed            so few vertices get no map
  /// \param vertices_per_cell  on average; fewer make a finer map
  explicit SupportMap(const stimuli::ConvexMesh& mesh, std::size_t climbed = kClimbed,
                      double vertices_per_cell = 8);

  bool empty() const { return cells_.empty(); }
  /// A vertex near the one farthest along `direction` (any length but 0); not empty.
  std::uint32_t near_support(const Vec3& direction) const;

 private:
  int resolution_ = 0;  // cells along an edge of the cube
  std::vector<std::uint32_t> cells_;
};

}  // namespace palpate::rendering
