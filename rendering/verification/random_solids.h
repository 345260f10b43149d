#pragma once
// Random convex solids of many kinds, proportions and sizes, for searches and extreme cases.

#include <vector>

#include "data/base/random.h"
#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"

namespace palpate::rendering {

// Random draws of the searches and cases.

/// Uniform from low to high.
inline double between(Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

/// Uniform on the unit sphere.
inline Vec3 random_direction(Random& random) {
  return stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
}

// Random paths of a probe over one convex mesh, meant to be hard for a renderer. For searches and
// extreme cases. Mesh frame, m.

enum class PathKind {
  smooth,   ///< a hand that wanders in and out, 1e-4 to 0.03 sizes a tick
  sliding,  ///< always near the surface, from just outside to beyond the middle
  fast,     ///< straight past and through, 5 m/s or 0.01 to 3 sizes a tick, turning
  plunges,  ///< from outside, by 1e-16 to 1 sizes, straight in and out again
  jumps,    ///< an unrelated pose at every tick
  aligned,  ///< along edges, in planes of facets, through corners: exactly or nearly
};
inline constexpr int kPathKinds = 6;
const char* to_string(PathKind kind);

/// The first pose is far outside; 1 kHz.
/// \param length  m, of the probe
/// \param side    false: the tip moves over the surface, not the side
std::vector<LineProbe> random_path(Random& random, PathKind kind, const stimuli::ConvexMesh& mesh,
                                   double length, bool side, std::size_t ticks);

/// A cube of edge 1 about the origin, cut by `cuts` random planes: corners of three facets, facets
/// of any number of sides.
stimuli::PolygonSoup cut_cube(Random& random, int cuts);

/// The polar dual of cut_cube: triangles, corners of any number of facets.
stimuli::PolygonSoup polar_of_cut_cube(Random& random, int cuts);

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

}  // namespace palpate::rendering
