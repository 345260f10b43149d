#pragma once
// Meshes for comparisons: coarser ones of a given mesh, convex hulls, and machine parts.

#include <cstddef>
#include <string>
#include <vector>

#include "stimuli/closed_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {

/// An object with this mesh, as if it were read from a Wavefront file of this name.
stimuli::ObjectSpec mesh_object(const stimuli::PolygonSoup& soup, const std::string& name);

/// About so many triangles: edges collapse in order of their quadric error (Garland & Heckbert
/// 1997, "Surface simplification using quadric error metrics"). An edge stays if its collapse would
/// turn a triangle over or change the surface's holes. The result may pass through itself.
stimuli::PolygonSoup coarsened(const stimuli::ClosedSurface& surface, std::size_t triangles);

/// Appends the corners of an object's shapes. \param parent  pose of the object's own frame
void add_corners(const stimuli::ObjectSpec& object, const Pose& parent, std::vector<Vec3>& out);
/// The convex hull of a rigid object that stands still; others as they are.
/// \param number  of the object, for a name
stimuli::ObjectSpec hull_of(const stimuli::ObjectSpec& object, int number);

/// Of `teeth` teeth around the z axis, with a bore: 4 * teeth corners round each.
stimuli::PolygonSoup gear(int teeth);
/// 60 x 60 x 8 mm with `columns` * `columns` round bores.
stimuli::PolygonSoup plate_with_bores(int columns);
/// A ball of 30 mm with bumps, hollows and the noise of a scanner: 20 * 4^subdivisions triangles.
stimuli::PolygonSoup scan(int subdivisions);

}  // namespace palpate::runner::evidence
