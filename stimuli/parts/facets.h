#pragma once
// A linked surface as cutting needs it: planes of its facets, convex polygons, concave edges.

#include "stimuli/half_edges.h"
#include "stimuli/parts/cell.h"
#include "stimuli/parts/planes.h"
#include "stimuli/parts/solid.h"

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

}  // namespace palpate::stimuli
