#pragma once
// Where a stimulus has edges that can be felt: what edge dwell is measured from.

#include <array>
#include <cstddef>
#include <vector>

#include "rendering/scene.h"

namespace palpate::runner {

/// The sharp edges of a scene's parts, those at which the surface turns by kLeastTurn or more, and
/// the sharp vertices that are on none of them (the tip of a cone): there some two facets differ by
/// as much. So the facets of a round shape have none, and the rims of a cylinder are sharp. An edge
/// of a convex part counts also where the union of the parts is smooth. Parts of layers
/// count where there is no surface above them. Immutable, so threads can share it.
class SharpEdges {
 public:
  static constexpr double kLeastTurn = 0.5235987755982988;  ///< rad; 30 degrees
  /// More edges and vertices than this are treated as texture: no edge is resolved.
  static constexpr std::size_t kMost = 2000;

  SharpEdges() = default;
  explicit SharpEdges(const rendering::Scene& scene);

  /// m, to the nearest one; infinite where there is none. Costs some nanoseconds for each.
  double distance(const Vec3& point) const;
  /// More than kMost were found, and none kept.
  bool too_many() const { return too_many_; }
  /// m, ends of each edge; a sharp vertex is one of no length.
  std::vector<std::array<Vec3, 2>> lines() const;

 private:
  struct Line {
    Vec3 from, along;       ///< m; along: to its other end, zero for a vertex
    double inverse_square;  ///< 1/m^2, of its length; 0 for a vertex
  };
  void add_part(const rendering::ScenePart& part);
  void add_surface(const rendering::PlacedSurface& placed);

  std::vector<Line> lines_;
  bool too_many_ = false;
};

}  // namespace palpate::runner
