#pragma once
// Plane, area and diameter of a polygon.

#include <span>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Of a plane polygon, counter-clockwise seen from outside.
struct PolygonPlane {
  Vec3 normal;          ///< unit, outward; zero for a polygon without area
  Vec3 middle;          ///< m, mean of the corners
  double area = 0;      ///< m^2
  double diameter = 0;  ///< m, within a factor of two of the largest distance of two corners
};

/// As exact as the corners allow, also for polygons a million times longer than wide.
PolygonPlane plane_of(std::span<const Vec3> corners);

}  // namespace palpate::stimuli
