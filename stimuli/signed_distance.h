#pragma once
// Exact signed distances: the reference for renderers and the geometry of simulated percepts. Local
// frame, SI units.

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

class ConvexMesh;

struct SurfaceDistance {
  double distance = 0;  ///< m; negative inside
  Vec3 normal;          ///< unit; gradient of the distance where it is defined, outward
};

/// Distance to the analytic sphere, cone, cylinder, cube or box in its local frame; pose and
/// tessellation are not used. Where the gradient is not defined the normal is a choice among its
/// neighbours: at equal depths inside, the side of a cone or cylinder before its ends and x before
/// y before z of a cube; on an axis or middle plane the positive direction (+x, +y, +z), at a
/// sphere's centre +z.
/// \throws std::invalid_argument for a mesh or compound.
SurfaceDistance signed_distance(const ObjectSpec& primitive, const Vec3& point);

/// Distance to the polyhedron, by visiting every facet. Costs O(facets): for checks, not for the
/// servo. At equal depths inside, the normal is that of the facet with the lowest number; on the
/// surface (within 1e-12 of the size) that of the facet whose plane is the most in front.
SurfaceDistance signed_distance(const ConvexMesh& mesh, const Vec3& point);

}  // namespace palpate::stimuli
