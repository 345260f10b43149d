#pragma once
// Large plane faces of a closed surface, as CAD programs make them: a polygon of many corners, cut
// into long slivers.

#include <cstdint>
#include <vector>

#include "stimuli/closed_surface.h"

namespace palpate::stimuli {

/// The plane face of each triangle, if 64 or more triangles make it, numbered from 0; else
/// kNoFlatFace. Empty: there is none.
/// \param tolerance  m; all corners of a face are within it of one plane
std::vector<std::uint32_t> find_flat_faces(const ClosedSurface& surface, double tolerance);

/// Cuts the plane faces (ClosedSurface::flat_face) anew, so that their triangles are short and what
/// is near a place is few of them: as long as it makes it shorter, the edge between a sliver and
/// its neighbour becomes the other diagonal of both. A fan of n triangles becomes a hierarchy of
/// log n levels. Corners and outline stay. Triangles that may bound a pocket stay, and so do those
/// whose other cut would be less than 64 times as high as the unevenness that rounding leaves in
/// the face.
void cut_flat_faces_anew(ClosedSurface& surface);

}  // namespace palpate::stimuli
