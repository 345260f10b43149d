#pragma once
// The planes that a solid is cut by: equal planes have one number.

#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

struct Plane {
  Vec3 normal;        ///< unit
  double offset = 0;  ///< m; dot(normal, p) == offset

  double height(const Vec3& point) const {
    return normal.x * point.x + normal.y * point.y + normal.z * point.z - offset;
  }
};

/// A plane of the table, seen from one of its sides.
struct PlaneSide {
  std::uint32_t plane = 0;
  bool flipped = false;  ///< the outward normal is the plane's, turned round
};

class PlaneTable {
 public:
  /// \param tolerance  m; points nearer than this are on a plane
  explicit PlaneTable(double tolerance) : tolerance_(tolerance) {}

  double tolerance() const { return tolerance_; }
  const Plane& operator[](std::uint32_t plane) const { return planes_[plane]; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(planes_.size()); }

  /// A plane of the table that all points lie on, or `plane`, which is added. Points must span it.
  PlaneSide number(const Plane& plane, std::span<const Vec3> points);

 private:
  double tolerance_;
  std::vector<Plane> planes_;
};

}  // namespace palpate::stimuli
