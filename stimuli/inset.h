#pragma once
// The surface of a body, or of a solid of several convex parts, moved inwards. The mesh's own
// frame, one for all parts. SI units.

#include <memory>
#include <vector>

#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

class ConvexMesh;

struct Ball {
  Vec3 centre;        ///< m
  double radius = 0;  ///< m
};

/// A half-space: dot(normal, p) <= offset.
struct HalfSpace {
  Vec3 normal;        ///< unit, outward
  double offset = 0;  ///< m
};

/// The body behind all planes. They must bound one; redundant planes give no facet.
/// \param inside  m, a point inside, preferably far from all planes
/// \param size    m, about that of the body: its vertices lie on their planes within 1e-11 of it
/// \throws MeshError where the body is too thin to distinguish from a plane
std::shared_ptr<const ConvexMesh> body_behind(const std::vector<HalfSpace>& half_spaces,
                                              const Vec3& inside, double size);

/// The largest ball in the body (one of them, where there are several).
Ball largest_inscribed_ball(const ConvexMesh& mesh);

/// The body behind all planes of the surface when each has moved inwards along its normal by
/// `depth` (m, above 0); facets that lose their whole area are gone. Its vertices lie on the moved
/// planes within 1e-11 of the mesh's size. nullptr: nothing is left, because the largest inscribed
/// ball has a radius of at most `depth`. \throws MeshError where the rest is too thin to
/// distinguish from a plane.
std::shared_ptr<const ConvexMesh> inset(const ConvexMesh& mesh, double depth);

/// Greatest depth of a concave solid's layer, relative to the nominal depth. The exact layer is
/// round about concave edges and corners; this one has facets there.
inline constexpr double kInsetWithin = 1.1;

/// The points of the union of the parts that are farther than `depth` (m) from its surface, as
/// convex parts that overlap. The parts may abut (within 1e-6 of their size), overlap or stand
/// apart; a face between two of them is not surface. Nothing in them is nearer to the surface than
/// `depth`, but for those 1e-6. Empty: nothing is left. One part: inset of it.
/// \throws MeshError where something would be missing beyond kInsetWithin times the depth
std::vector<std::shared_ptr<const ConvexMesh>> inset_union(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth);

/// The pieces of that inside `within`, which are some of the parts: the layer of those parts alone,
/// under the surface of the whole union. It ends where they do.
std::vector<std::shared_ptr<const ConvexMesh>> inset_union_within(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth,
    const std::vector<std::shared_ptr<const ConvexMesh>>& within);

/// m; from about this depth on nothing is left: the radius of the largest ball in any of the sets
/// that inset_union moves inwards.
double largest_inset(const std::vector<std::shared_ptr<const ConvexMesh>>& parts);

}  // namespace palpate::stimuli
