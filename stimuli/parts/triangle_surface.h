#pragma once
// A closed polyhedral surface as triangles: its volume, and how often it winds round a point. m.

#include <array>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Closed; triangles counter-clockwise seen from outside. m.
using TriangleSurface = std::vector<std::array<Vec3, 3>>;

struct SolidBulk {
  double volume = 0;  ///< m^3, by the divergence theorem; negative: inside out
  double area = 0;    ///< m^2
};
SolidBulk bulk_of(const TriangleSurface& surface);

/// 0 outside, 1 inside a simple solid; near an integer anywhere but on the surface. Sum of the
/// triangles' signed solid angles (van Oosterom & Strackee 1983), so its cost is their number.
double winding_number(const TriangleSurface& surface, const Vec3& point);

}  // namespace palpate::stimuli
