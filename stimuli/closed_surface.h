#pragma once
// A closed, oriented surface of triangles, as any mesh file gives one. It defines "inside" for the
// renderers. The mesh's own frame, SI units.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stimuli/polygon_soup.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

inline constexpr std::uint32_t kNoFlatFace = 0xffffffff;  ///< of ClosedSurface::flat_face

/// Every side of a triangle has one neighbour, which runs along it the opposite way. The solid is
/// where the surface winds round a point a positive number of times. It winds round a point a
/// negative number of times only in pockets that no hand can feel.
struct ClosedSurface {
  std::vector<Vec3> vertices;  ///< m; no two at the same place, each in some triangle
  /// Counter-clockwise seen from outside; three different corners, never in one line.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// The triangle beyond the side from corner k to corner k + 1. Where more than two triangles meet
  /// in an edge, each two neighbours have solid between them.
  std::vector<std::array<std::uint32_t, 3>> across;
  double coordinate_error = 0;  ///< m, of each coordinate as its file rounds it; 0: not rounded
  /// Triangles that may bound a pocket, or a part of each does: there is no solid behind that part.
  std::vector<std::uint32_t> at_pockets = {};
  /// Of each triangle, the large plane face that it is part of (flat_faces.h), numbered from 0, or
  /// kNoFlatFace. Empty: there is no such face.
  std::vector<std::uint32_t> flat_face = {};
};

/// The surface that polygons bound, and what was done to them to get it.
struct CleanedSurface {
  ClosedSurface surface;
  std::vector<std::string> notes;  ///< "3 faces without area left out"; empty: taken as they stand
};

/// Welds corners at equal coordinates, triangulates, leaves out triangles without area within the
/// coordinates' error (their neighbours close the gap), cuts large plane faces anew (flat_faces.h).
/// Shells may overlap.
/// \throws MeshError with the faults of the polygons as their file names them, and advice: open,
/// turned, inside out, winds round some place a negative number of times, not finite, too large.
CleanedSurface closed_surface(const PolygonSoup& soup);

/// The same for a large mesh: gives up the polygons as soon as they are welded, and calls
/// `meanwhile` with the surface, which may still turn out to be no solid, in this thread while
/// another one checks how it winds. `at_pockets` is empty then. Faults name no faces.
CleanedSurface closed_surface(PolygonSoup&& soup,
                              const std::function<void(const ClosedSurface&)>& meanwhile);

/// The notes of closed_surface(), for polygons that are known to bound convex solids.
/// \throws MeshError  as that one, but for how they wind
std::vector<std::string> cleaning_notes(const PolygonSoup& soup);

/// Pockets, where a surface winds round a place a negative number of times, because it passes
/// through itself.
struct Pockets {
  std::vector<std::uint32_t> triangles;  ///< as of ClosedSurface::at_pockets
  double depth = 0;                      ///< m, of the deepest
  Vec3 place;                            ///< m, in that one
};

/// \param tolerance  m; places that are not farther than this from the surface do not count
/// \param name  of a triangle, for messages
/// \return pockets that no hand can feel
/// \throws MeshError: a shell is turned inside out and in no other, the surface passes through
/// itself so that it winds round a place a negative number of times, there is no volume
Pockets check_winding(const ClosedSurface& surface, double tolerance,
                      const std::function<std::string(std::uint32_t triangle)>& name);

}  // namespace palpate::stimuli
