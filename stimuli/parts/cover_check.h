#pragma once
// Whether convex parts are a solid, no more and no less.

#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_faults.h"
#include "stimuli/parts/solid.h"

namespace palpate::stimuli {

/// m^3
double volume_of(const ConvexMesh& mesh);

/// Adds a fault where the volumes do not add up (within 1e-9 of the volume and `slack`, m, times
/// the area) or where a sampled point lies in more or fewer parts than it should.
void check_cover(const TriangleSurface& solid, const std::vector<ConvexMesh>& parts, double slack,
                 MeshFaults& faults);

}  // namespace palpate::stimuli
