#include "stimuli/parts/planes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::stimuli {

PlaneSide PlaneTable::number(const Plane& plane, std::span<const Vec3> points) {
  // Small polygons fit many planes within the tolerance: those are told apart by their normals.
  constexpr double kSameDirection = 0.99;
  for (std::uint32_t i = 0; i < size(); ++i) {
    const double turned = glm::dot(planes_[i].normal, plane.normal);
    if (std::abs(turned) < kSameDirection) continue;
    const bool on = std::all_of(points.begin(), points.end(), [&](const Vec3& point) {
      return std::abs(planes_[i].height(point)) <= tolerance_;
    });
    if (on) return {i, turned < 0};
  }
  planes_.push_back(plane);
  return {size() - 1, false};
}

}  // namespace palpate::stimuli
