#pragma once
// The outlines of the maximal planar regions of a linked surface. The third step of building a
// ConvexMesh.

#include <vector>

#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"

namespace palpate::stimuli {

/// Region r has the sides first[r] .. first[r + 1], counter-clockwise seen from outside. A side may
/// run along several half-edges; the vertices between them are no corners.
struct FacetOutlines {
  using Index = HalfEdges::Index;

  std::vector<Index> first;
  std::vector<Index> start;     ///< of each side: the half-edge at its first corner
  std::vector<Index> opposite;  ///< of each side: the same side of the region across
  std::vector<Index> region;    ///< of each side

  Index region_count() const { return static_cast<Index>(first.size() - 1); }
  Index side_count() const { return static_cast<Index>(start.size()); }
};

/// A corner is a vertex where three or more regions meet. Reports regions with holes and regions
/// with fewer than three corners; the result is of use only when there are none.
FacetOutlines facet_outlines(const HalfEdges& mesh, const std::vector<HalfEdges::Index>& region_of,
                             HalfEdges::Index region_count, MeshFaults& faults);

}  // namespace palpate::stimuli
