#pragma once
// The four shapes of the experiment as polygon soups. Vertices lie on the analytic surface;
// vertex k of a rim stands at the angle 2 pi k / segments from +x. SI units.

#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {

class ConvexMesh;

PolygonSoup icosphere(double radius, int subdivisions);        ///< 20 * 4^subdivisions triangles
PolygonSoup cone(double radius, double height, int segments);  ///< axis +z, apex at +height/2
PolygonSoup cylinder(double radius, double height, int segments);  ///< axis +z, centred
PolygonSoup cube(double edge);                                     ///< centred
PolygonSoup box(const Vec3& size);  ///< centred, edges along the axes

/// The polygons of a primitive or mesh file in its local frame (pose and parts are not applied).
/// \throws MeshError, std::runtime_error for an unreadable file; std::invalid_argument for a
/// compound.
PolygonSoup polygons_of(const ObjectSpec& spec);

// Exact signed distances: the reference for renderers and the geometry of simulated percepts.
// Local frame, SI units.

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
