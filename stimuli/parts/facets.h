#pragma once
// A linked surface as cutting needs it: planes of its facets, convex polygons, concave edges,
// triangles.

#include <span>
#include <vector>

#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"
#include "stimuli/parts/cell.h"

namespace palpate::stimuli {

struct ConcaveEdge {
  Vec3 from, to;          ///< m
  Vec3 left, right;       ///< unit outward normals of its two facets
  PlaneSide on[2];        ///< their planes
  std::uint32_t ends[2];  ///< numbers of its ends
};

struct FacetedSolid {
  std::vector<Vec3> points;          ///< m, the corners, welded
  std::vector<CellPolygon> surface;  ///< convex polygons
  std::vector<ConcaveEdge> concave;
  TriangleSurface triangles;
  double size = 0;   ///< m, diagonal of the bounding box
  double error = 0;  ///< m, of each coordinate
};

/// Adds the facets' planes to the table. Adds a fault for each polygon that crosses itself.
FacetedSolid faceted_solid(const HalfEdges& mesh, PlaneTable& planes, MeshFaults& faults);

// Triangles of a plane polygon that need not be convex.

/// Cuts off ears (Meisters 1975), the best-shaped first. Counter-clockwise about `normal` (of any
/// length), as the corners are. Empty where the polygon crosses itself. Costs corners^3 at worst,
/// corners where it is convex.
TriangleSurface triangulate(std::span<const Vec3> corners, const Vec3& normal);

/// The same, about the polygon's own normal.
TriangleSurface triangulate(std::span<const Vec3> corners);

// Its convex parts.

/// Limit before cutting is refused: a scan with a rough surface would fall into thousands of parts.
inline constexpr std::size_t kMostConcaveEdges = 4000;
inline constexpr std::size_t kMostParts = 512;

/// The solid as convex polyhedra with disjoint interiors, before merging. A tree of planes (Fuchs,
/// Kedem & Naylor 1980; solids: Thibault & Naylor 1987) whose planes are chosen at concave edges:
/// space is cut into convex cells until the surface inside a cell bounds one convex piece. Adds
/// faults: too many concave edges or parts, a surface that cuts itself.
std::vector<std::vector<CellPolygon>> cut_at_concave_edges(const FacetedSolid& solid,
                                                           PlaneTable& planes, MeshFaults& faults);

}  // namespace palpate::stimuli
