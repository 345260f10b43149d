#pragma once
// Random convex solids of many kinds, proportions and sizes, for searches and extreme cases.

#include "data/base/random.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// A cube of edge 1 about the origin, cut by `cuts` random planes: corners of three facets, facets
/// of any number of sides.
stimuli::PolygonSoup cut_cube(Random& random, int cuts);

/// Every corner's coordinates times these factors; convexity is kept.
stimuli::PolygonSoup stretched(stimuli::PolygonSoup soup, const Vec3& factors);

/// The part of a convex solid below the plane dot(normal, x) == offset, which goes through no
/// corner.
stimuli::PolygonSoup part_below(const stimuli::PolygonSoup& solid, const Vec3& normal,
                                double offset);

/// Turned, scaled by `scale` and then moved.
stimuli::PolygonSoup turned_and_moved(stimuli::PolygonSoup soup, const Quat& turn, double scale,
                                      const Vec3& to);

/// A cut cube, its polar dual, a sphere, cone, cylinder or cube; half of them stretched into plates
/// and needles of proportions down to 1e-4; turned at random or along the axes; 0.1 mm to 100 m
/// across, up to a size away from the origin.
stimuli::ConvexMesh random_solid(Random& random);

}  // namespace palpate::runner::evidence
