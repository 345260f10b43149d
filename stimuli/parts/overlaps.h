#pragma once
// Overlaps of convex parts. One frame for all parts, SI units.

#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {

/// m^3; of the intersection. 0 for bodies that abut.
double common_volume(const ConvexMesh& a, const ConvexMesh& b);

/// One sentence for each two groups of a mesh file that overlap by more than a millionth of the
/// smaller one. Overlaps are allowed, because an object is the union of its parts, but an author of
/// parts that should abut wants to know.
/// \throws as convex_parts
std::vector<std::string> group_overlaps(const ObjectSpec& spec);

}  // namespace palpate::stimuli
