#pragma once
// Checks that a mesh is convex. The last step of building a ConvexMesh.

#include <cstdint>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_faults.h"

namespace palpate::stimuli {

/// Reports where a closed, connected mesh is not the surface of a convex body. It is one when it is
/// convex at every edge, round every vertex and in every facet (van Heijenoort 1952): it must wind
/// round each just once, for a star that is wound twice has convex edges only. A final check of
/// every facet for vertices in front of its plane guards against accumulated tolerances.
/// \param soup_vertex the number of each vertex in the input, for messages with what `naming` calls
/// it
/// \param error m, how far a coordinate may be from where it was meant
void check_convexity(const ConvexMesh& mesh, const std::vector<std::uint32_t>& soup_vertex,
                     const MeshNaming& naming, double error, MeshFaults& faults);

}  // namespace palpate::stimuli
