#pragma once
// How far two neighbouring polygons are from lying in one plane. SI units.

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// The extent of a polygon relative to one of its sides.
class PolygonExtent {
 public:
  /// `side`: from the side's first corner to its second, m.
  explicit PolygonExtent(const Vec3& side);

  /// `arm`: from the side's first corner to any corner of the polygon, m.
  void include(const Vec3& arm);

  double across() const { return across_; }      ///< m, how far it extends from the side's line
  double overhang() const { return overhang_; }  ///< how far past the side's ends, in side lengths

 private:
  Vec3 along_;
  double length_;
  double across_ = 0, overhang_ = 0;
};

/// The distance by which the corners of two polygons that share a side would have to be moved to
/// lie in one plane, as a multiple of the error (m) of the corners; negative for a reflex (concave)
/// edge. Up to kCoplanar in size they are coplanar within the error.
/// \param side  as it runs in the polygon of `normal` and `extent`; the others belong to the
/// polygon across
double plane_deviation(const Vec3& normal, const Vec3& normal_across, const Vec3& side,
                       const PolygonExtent& extent, const PolygonExtent& extent_across,
                       double error);
inline constexpr double kCoplanar = 4;

}  // namespace palpate::stimuli
