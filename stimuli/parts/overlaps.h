#pragma once
// Where convex parts have room in common. One frame for all parts, SI units.

#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {

/// m^3; of what lies in both. 0 for bodies that abut.
double common_volume(const ConvexMesh& a, const ConvexMesh& b);

/// One sentence for each two groups of a mesh file that overlap by more than a millionth of the
/// smaller one. They are taken: an object is the union of its parts. But whoever drew parts that
/// should abut wants to know.
/// \throws as convex_parts
std::vector<std::string> group_overlaps(const ObjectSpec& spec);

}  // namespace palpate::stimuli
