#pragma once
// Merging coplanar faces of a linked surface to facets. The second step of building a ConvexMesh.

#include <vector>

#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// A face, as merging needs it.
struct FaceShape {
  double area = 0;    ///< m^2
  Vec3 normal;        ///< unit, outward; undefined when thin
  Vec3 middle;        ///< m, mean of the corners
  bool thin = false;  ///< degenerate: no wider than the error of its corners, so it has no plane
};
std::vector<FaceShape> shapes_of(const HalfEdges& mesh);

/// Reports polygons whose corners are not in one plane.
void check_flatness(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                    MeshFaults& faults);

/// The deviation from one plane (convex_mesh.h) of the face of a half-edge and the face across.
double plane_deviation_at(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                          HalfEdges::Index h);

/// For each face the number of the maximal planar region that it belongs to; regions are numbered
/// from 0 in the order of their first faces. \param[out] count the number of regions.
std::vector<HalfEdges::Index> coplanar_regions(const HalfEdges& mesh,
                                               const std::vector<FaceShape>& shapes,
                                               HalfEdges::Index& count);

/// The same, but merges degenerate faces only.
std::vector<HalfEdges::Index> single_regions(const HalfEdges& mesh,
                                             const std::vector<FaceShape>& shapes,
                                             HalfEdges::Index& count);

}  // namespace palpate::stimuli
