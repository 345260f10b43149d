#pragma once
// The four shapes of the experiment as polygon soups. Vertices lie on the analytic surface;
// vertex k of a rim stands at the angle 2 pi k / segments from +x. SI units.

#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {

PolygonSoup icosphere(double radius, int subdivisions);        ///< 20 * 4^subdivisions triangles
PolygonSoup cone(double radius, double height, int segments);  ///< axis +z, apex at +height/2
PolygonSoup cylinder(double radius, double height, int segments);  ///< axis +z, centred
PolygonSoup cube(double edge);                                     ///< centred
PolygonSoup box(const Vec3& size);  ///< centred, edges along the axes

/// The polygons of a primitive or mesh file in its local frame (pose and parts are not applied).
/// \throws MeshError, std::runtime_error for an unreadable file; std::invalid_argument for a
/// compound.
PolygonSoup polygons_of(const ObjectSpec& spec);

}  // namespace palpate::stimuli
