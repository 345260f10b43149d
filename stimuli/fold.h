#pragma once

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// How a polygon lies against one of its sides.
class Reach {
 public:
  /// `side`: from the side's first corner to its second, m.
  explicit Reach(const Vec3& side);

  /// `arm`: from the side's first corner to any corner of the polygon, m.
  void include(const Vec3& arm);

  double across() const { return across_; }      ///< m, how far it extends from the side's line
  double overhang() const { return overhang_; }  ///< how far past the side's ends, in side lengths

 private:
  Vec3 along_;
  double length_;
  double across_ = 0, overhang_ = 0;
};

/// How far two polygons that share a side are from being one plane: the distance by which their
/// corners would have to be moved, over the error (m) of the corners. Below kCoplanar they are one
/// plane within what is known of them; negative for a dent.
/// \param side as it runs in the polygon of `normal`, `reach`; the others are of the one across
double fold(const Vec3& normal, const Vec3& normal_across, const Vec3& side, const Reach& reach,
            const Reach& reach_across, double error);
inline constexpr double kCoplanar = 4;

}  // namespace palpate::stimuli
