#pragma once
// The surface of a convex body moved inwards. The mesh's own frame, SI units.

#include <memory>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

struct Ball {
  Vec3 centre;        ///< m
  double radius = 0;  ///< m
};

/// The largest ball in the body (one of them, where there are several).
Ball largest_inscribed_ball(const ConvexMesh& mesh);

/// The body behind all planes of the surface when each has moved inwards along its normal by
/// `depth` (m, above 0); facets that lose their whole area are gone. Its vertices lie on the moved
/// planes within 1e-11 of the mesh's size. nullptr: nothing is left, since the largest inscribed
/// ball has no larger radius. \throws MeshError where what is left is too thin to be told from a
/// plane.
std::shared_ptr<const ConvexMesh> inset(const ConvexMesh& mesh, double depth);

}  // namespace palpate::stimuli
