#include "stimuli/plane_deviation.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::stimuli {

PolygonExtent::PolygonExtent(const Vec3& side)
    : along_(glm::normalize(side)), length_(glm::length(side)) {}

void PolygonExtent::include(const Vec3& arm) {
  const double t = glm::dot(arm, along_);
  across_ = std::max(across_, glm::length(arm - t * along_));
  overhang_ = std::max({overhang_, -t / length_, t / length_ - 1});
}

double plane_deviation(const Vec3& normal, const Vec3& normal_across, const Vec3& side,
                       const PolygonExtent& extent, const PolygonExtent& extent_across,
                       double error) {
  const double sine = glm::dot(glm::cross(normal, normal_across), glm::normalize(side));
  // Past a right angle the sine falls again, the deviation does not. At more than 60 degrees
  // polygons are not coplanar, whatever the error.
  const bool sharp = glm::dot(normal, normal_across) < 0.5;
  const double near = extent.across(), far = extent_across.across();
  const double moved = (sharp ? 1 : std::abs(sine)) * near * far / (near + far);
  const double lever = 1 + std::max(extent.overhang(), extent_across.overhang());
  double deviation = moved / (error * lever);
  if (sharp) deviation = std::max(deviation, 2 * kCoplanar);
  return std::copysign(deviation, sine);
}

}  // namespace palpate::stimuli
