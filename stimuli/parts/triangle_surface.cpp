#include "stimuli/parts/triangle_surface.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace palpate::stimuli {

SolidBulk bulk_of(const TriangleSurface& surface) {
  SolidBulk bulk;
  for (const auto& [a, b, c] : surface) {
    const Vec3 twice_area = glm::cross(b - a, c - a);
    bulk.area += glm::length(twice_area) / 2;
    // From a corner of the solid: far from the origin the terms would cancel.
    bulk.volume += glm::dot(twice_area, a - surface[0][0]) / 6;
  }
  return bulk;
}

double winding_number(const TriangleSurface& surface, const Vec3& point) {
  double angle = 0;
  for (const auto& triangle : surface) {
    const Vec3 a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double over =
        la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    angle += std::atan2(glm::dot(a, glm::cross(b, c)), over);
  }
  return angle / (2 * std::numbers::pi);
}

}  // namespace palpate::stimuli
