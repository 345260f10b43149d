#pragma once
// Convex solids of every kind, proportion and size, for searches and extreme cases.

#include "stimuli/convex_mesh.h"
#include "stimuli/random.h"

namespace palpate {

/// A cube of edge 1 about the origin, cut by `cuts` random planes: corners of three facets, facets
/// of any number of sides.
PolygonSoup cut_cube(Random& random, int cuts);

/// The polar of cut_cube: triangles, corners of any number of facets.
PolygonSoup polar_of_cut_cube(Random& random, int cuts);

/// Every corner's coordinates times these factors; a convex solid stays one.
PolygonSoup stretched(PolygonSoup soup, const Vec3& factors);

/// Turned, scaled by `scale` and then moved.
PolygonSoup turned_and_moved(PolygonSoup soup, const Quat& turn, double scale, const Vec3& to);

/// A cut cube, its polar, a sphere, cone, cylinder or cube; half of them stretched into plates and
/// needles of proportions down to 1e-4; turned at random or along the axes; 0.1 mm to 100 m across,
/// up to a size away from the origin.
ConvexMesh random_solid(Random& random);

}  // namespace palpate
