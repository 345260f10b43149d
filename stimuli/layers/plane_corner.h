#pragma once
// The point that several planes have in common.

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// The point with the least sum of squared distances to planes, as near to the mean of their points
/// as the planes let it be (Ju et al. 2002, 2.3).
class PlaneCorner {
 public:
  /// \param normal  unit
  void add(const Vec3& point, const Vec3& normal);
  /// \param rank  number of directions in which the planes decide, 1 to 3
  Vec3 corner(int rank) const;
  bool operator==(const PlaneCorner&) const = default;

 private:
  Mat3 products_{0};  ///< sum of normal normal^T
  Vec3 offsets_;      ///< sum of normal (normal . point)
  Vec3 points_;       ///< m, sum
  double count_ = 0;
};

}  // namespace palpate::stimuli
