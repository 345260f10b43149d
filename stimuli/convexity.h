#pragma once

#include <cstdint>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_faults.h"

namespace palpate {

/// Reports where a closed, connected mesh whose edges are all convex is not the surface of a convex
/// body after all. Such a surface bounds a convex body when it is convex round every vertex and in
/// every facet (van Heijenoort 1952), that is, when it winds round each just once: a star wound
/// twice has convex edges only. A last look from every facet for vertices in front of its plane
/// guards against tolerances having added up.
/// \param soup_vertex the number of each vertex in the input, for messages
/// \param tolerance m, how far a vertex may stand in front of a facet's plane
void check_convexity(const ConvexMesh& mesh, const std::vector<std::uint32_t>& soup_vertex,
                     double tolerance, MeshFaults& faults);

}  // namespace palpate
