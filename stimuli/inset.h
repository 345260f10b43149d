#pragma once
// The surface of a convex body moved inwards. The mesh's own frame, SI units.

#include <memory>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

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

}  // namespace palpate::stimuli
