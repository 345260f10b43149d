#pragma once
// Cutting a concave solid into convex parts.

#include <vector>

#include "stimuli/parts/cell.h"
#include "stimuli/parts/facets.h"

namespace palpate::stimuli {

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
