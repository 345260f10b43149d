#pragma once
// How deep points lie in a solid. One frame, SI units.

#include <optional>
#include <span>

#include "stimuli/closed_surface.h"
#include "stimuli/triangle_tree.h"

namespace palpate::stimuli {

/// A closed surface as it stands in an object.
struct PlacedShell {
  const ClosedSurface* surface = nullptr;
  Pose pose;  ///< in the object
};

/// The union of the solids of closed surfaces, which may abut, overlap and pass through themselves.
class SolidDepth {
 public:
  explicit SolidDepth(std::span<const PlacedShell> shells);

  struct Depth {
    double depth = 0;  ///< m, below the surface of the union; negative outside
    Vec3 inwards;      ///< unit, the way in which it grows
  };
  /// A place of known depth. Where the distance to it is less than its depth, or its height
  /// outside, no ray is cast.
  struct Known {
    Vec3 place;
    double depth = 0;  ///< m
  };
  Depth at(const Vec3& point, const Known* near = nullptr) const;

  /// Whether one plane face alone is certainly nearest to every point of the ball: there depth is
  /// linear.
  bool plane_in(const Vec3& centre, double radius) const;

  bool empty() const { return tree().empty(); }    ///< no volume
  Vec3 low() const { return tree().box().low; }    ///< m, of the box about it
  Vec3 high() const { return tree().box().high; }  ///< m
  /// m; parts nearer than this abut: there is no surface between them.
  double slack() const { return slack_; }

 private:
  const TriangleTree& tree() const { return exposed_ ? *exposed_ : all_; }

  double slack_ = 0;
  TriangleTree all_;                     ///< tells inside from outside
  std::optional<TriangleTree> exposed_;  ///< of the union's surface; empty: all are
};

}  // namespace palpate::stimuli
