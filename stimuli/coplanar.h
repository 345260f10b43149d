#pragma once
// Which faces of a linked surface lie in one plane. The second stage of building a ConvexMesh.

#include <cstdint>
#include <vector>

#include "stimuli/fold.h"
#include "stimuli/half_edges.h"
#include "stimuli/mesh_faults.h"

namespace palpate::stimuli {

/// What the merging needs to know of a face.
struct FaceShape {
  double area = 0;    ///< m^2
  Vec3 normal;        ///< unit, outward; of no use when thin
  Vec3 middle;        ///< m, mean of the corners
  bool thin = false;  ///< no wider than the error of its corners: it has no plane of its own
};
std::vector<FaceShape> shapes_of(const HalfEdges& mesh);

/// Reports polygons whose corners are not in one plane.
void check_flatness(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                    MeshFaults& faults);

/// The fold (fold.h) between the face of a half-edge and the face across.
double fold_at(const HalfEdges& mesh, const std::vector<FaceShape>& shapes, HalfEdges::Index h);

/// For each face the number of the maximal planar region that it belongs to; regions are numbered
/// from 0. \param[out] count the number of regions.
std::vector<HalfEdges::Index> coplanar_regions(const HalfEdges& mesh,
                                               const std::vector<FaceShape>& shapes,
                                               HalfEdges::Index& count);

/// The same with nothing merged but faces that have no plane of their own.
std::vector<HalfEdges::Index> single_regions(const HalfEdges& mesh,
                                             const std::vector<FaceShape>& shapes,
                                             HalfEdges::Index& count);

}  // namespace palpate::stimuli
