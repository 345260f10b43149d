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

/// What is behind all planes, which must bound a body. Planes that bound nothing of it are no
/// facets.
/// \param inside  m, a point inside, better far from all planes
/// \param size    m, about that of the body: its vertices lie on their planes within 1e-11 of it
/// \throws MeshError where the body is too thin to be told from a plane
std::shared_ptr<const ConvexMesh> body_behind(const std::vector<HalfSpace>& half_spaces,
                                              const Vec3& inside, double size);

/// The largest ball in the body (one of them, where there are several).
Ball largest_inscribed_ball(const ConvexMesh& mesh);

/// The body behind all planes of the surface when each has moved inwards along its normal by
/// `depth` (m, above 0); facets that lose their whole area are gone. Its vertices lie on the moved
/// planes within 1e-11 of the mesh's size. nullptr: nothing is left, since the largest inscribed
/// ball has no larger radius. \throws MeshError where what is left is too thin to be told from a
/// plane.
std::shared_ptr<const ConvexMesh> inset(const ConvexMesh& mesh, double depth);

}  // namespace palpate::stimuli
