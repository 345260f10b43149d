#pragma once
// Exact distances: the yardstick for renderers and the percepts' geometry.

#include "stimuli/convex_mesh.h"
#include "stimuli/object_spec.h"

namespace palpate {

struct SurfaceDistance {
  double distance = 0;  ///< m; negative inside
  Vec3 normal;          ///< unit; gradient of the distance where it is defined, outward
};

/// Of the analytic sphere, cone, cylinder or cube in its local frame.
/// \throws std::invalid_argument for a mesh or compound.
SurfaceDistance signed_distance(const ObjectSpec& primitive, const Vec3& point);

/// Of the polyhedron, by visiting every facet. Costs O(facets): for checks, not for the servo.
SurfaceDistance signed_distance(const ConvexMesh& mesh, const Vec3& point);

}  // namespace palpate
