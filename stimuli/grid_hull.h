#pragma once
// Convex hull in exact arithmetic.

#include <cstdint>
#include <vector>

#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

/// The convex hull of points.
struct GridHull {
  /// Triangles, exactly convex; some may be coplanar. Empty where the points span no volume.
  PolygonSoup soup;
  std::vector<std::uint32_t> point;  ///< of each vertex, its index in the points
  double depth = 0;                  ///< m; the largest distance of a point below the surface
};

/// Points are rounded to a grid finer than `error` (m, of each coordinate), on which every
/// predicate is evaluated exactly.
GridHull grid_hull(const std::vector<Vec3>& points, double error);

}  // namespace palpate::stimuli
