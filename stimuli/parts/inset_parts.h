#pragma once
// The surface of a solid of several convex parts moved inwards. One frame for all parts, SI units.

#include <memory>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

/// Greatest depth of a concave solid's layer, relative to the nominal depth. The exact layer is
/// round about concave edges and corners; this one has facets there.
inline constexpr double kInsetWithin = 1.1;

/// The points of the union of the parts that are farther than `depth` (m) from its surface, as
/// convex parts that overlap. The parts may abut (within 1e-6 of their size), overlap or stand
/// apart; a face between two of them is not surface. Nothing in them is nearer to the surface than
/// `depth`, but for those 1e-6. Empty: nothing is left. One part: inset of it.
/// \throws MeshError where something would be missing beyond kInsetWithin times the depth
std::vector<std::shared_ptr<const ConvexMesh>> inset_union(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth);

/// The pieces of that inside `within`, which are some of the parts: the layer of those parts alone,
/// under the surface of the whole union. It ends where they do.
std::vector<std::shared_ptr<const ConvexMesh>> inset_union_within(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth,
    const std::vector<std::shared_ptr<const ConvexMesh>>& within);

/// m; from about this depth on nothing is left: the radius of the largest ball in any of the sets
/// that inset_union moves inwards.
double largest_inset(const std::vector<std::shared_ptr<const ConvexMesh>>& parts);

}  // namespace palpate::stimuli
