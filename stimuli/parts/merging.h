#pragma once
// Joining convex neighbours whose union is convex.

#include <vector>

#include "stimuli/parts/cell.h"

namespace palpate::stimuli {

/// Polyhedra with disjoint interiors, fewer or as many as before: any two that share a plane and
/// whose union is convex become one, until there are none. Not the fewest possible.
void merge_convex_neighbours(std::vector<std::vector<CellPolygon>>& parts,
                             const PlaneTable& planes);

}  // namespace palpate::stimuli
