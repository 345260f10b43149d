#pragma once

#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

/// The convex hull of points that are known to `error` only.
struct GridHull {
  /// Triangles, convex to the last bit; some may lie in one plane. Empty where the points are no
  /// solid.
  PolygonSoup soup;
  double depth = 0;  ///< m; no point is farther below its surface
};

/// Points are moved to a grid finer than the error, on which all that is asked of them is answered
/// exactly.
GridHull grid_hull(const std::vector<Vec3>& points, double error);

}  // namespace palpate::stimuli
