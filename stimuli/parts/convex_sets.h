#pragma once
// Convex sets inside of a union of convex parts. One frame for all, SI units.

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stimuli/inset.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

using MeshPointer = std::shared_ptr<const ConvexMesh>;

/// m, height of a point over the plane that it is farthest in front of; negative inside.
double height_over(const ConvexMesh& mesh, const Vec3& p);

/// The corners of a facet, counter-clockwise.
std::vector<Vec3> corners_of(const ConvexMesh& mesh, std::uint32_t facet);

/// A convex set inside of the union.
struct ConvexSet {
  MeshPointer mesh;
  std::vector<HalfSpace> planes;  ///< the set is behind all; some may be redundant
};

ConvexSet whole(const MeshPointer& part);

/// The limits of a set's growth.
struct Kept {
  std::optional<HalfSpace> plane = std::nullopt;  ///< it must not grow through this
  std::optional<Vec3> point = std::nullopt;       ///< m, to keep; nullopt: only grow
  double depth = 0;                               ///< m, of the point behind each cut
};

/// How sets grow from part to part, as far as they stay convex.
class SetGrowth {
 public:
  /// \param abuts  share of the size of the largest part; parts nearer than this touch
  SetGrowth(const std::vector<MeshPointer>& parts, double abuts);

  double tolerance() const { return tolerance_; }  ///< m

  /// The set, grown into `others`, which must be inside the union. Where a point is to be kept, the
  /// set gives up space beside it to gain space beyond it.
  ConvexSet grown(ConvexSet set, const std::vector<MeshPointer>& others, const Kept& kept) const;

  /// The piece of the set behind a plane; nullopt: nothing.
  std::optional<ConvexSet> behind(const ConvexSet& set, const HalfSpace& plane) const;

 private:
  std::optional<ConvexSet> through(const ConvexSet& set, std::uint32_t f,
                                   const ConvexMesh& beyond) const;
  std::optional<ConvexSet> narrowed_through(const ConvexSet& set, std::uint32_t f,
                                            const ConvexMesh& beyond, const Kept& kept) const;
  std::optional<ConvexSet> step(const ConvexSet& set, const std::vector<MeshPointer>& others,
                                const Kept& kept, bool narrower) const;

  double abuts_, tolerance_ = 0;
};

}  // namespace palpate::stimuli
