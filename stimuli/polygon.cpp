#include "stimuli/polygon.h"

#include <cstddef>
#include <glm/geometric.hpp>

namespace palpate::stimuli {
namespace {

Vec3 farthest_from(const Vec3& point, std::span<const Vec3> corners) {
  Vec3 farthest = point;
  double most = 0;
  for (const Vec3& corner : corners) {
    const Vec3 apart = corner - point;
    const double squared = glm::dot(apart, apart);
    if (squared <= most) continue;
    most = squared;
    farthest = corner;
  }
  return farthest;
}

}  // namespace

PolygonPlane plane_of(std::span<const Vec3> corners) {
  PolygonPlane plane;
  for (const Vec3& corner : corners) plane.middle += corner - corners[0];
  plane.middle = corners[0] + plane.middle / static_cast<double>(corners.size());
  // Newell's method, about the middle.
  Vec3 twice_area;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const std::size_t next = k + 1 == corners.size() ? 0 : k + 1;
    twice_area += glm::cross(corners[k] - plane.middle, corners[next] - plane.middle);
  }
  // In a long and narrow polygon the products are large compared with their sum, and rounding tilts
  // the normal along the length, where it matters most: the far end of a needle would stand out.
  // The direction of the length is known well, so that component is removed.
  const Vec3 end = farthest_from(plane.middle, corners);
  const Vec3 chord = farthest_from(end, corners) - end;
  plane.diameter = glm::length(chord);
  if (plane.diameter > 0) {
    const Vec3 along = chord / plane.diameter;
    twice_area -= glm::dot(twice_area, along) * along;
  }
  const double length = glm::length(twice_area);
  plane.area = length / 2;
  if (length > 0) plane.normal = twice_area / length;
  return plane;
}

}  // namespace palpate::stimuli
