#pragma once
// The surface of a solid of several convex parts moved inwards. One frame for all parts, SI units.

#include <memory>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

/// How deep the layer of a concave solid may be where it should be 1 deep: at concave edges and
/// corners, round which the exact one is round, it has facets.
inline constexpr double kInsetWithin = 1.1;

/// The points of the union of the parts that are farther than `depth` (m) from its surface, as
/// convex parts that overlap. The parts may abut (within 1e-6 of their size), overlap or stand
/// apart; what lies between two of them is no surface. Nothing in them is nearer to the surface
/// than `depth`, but for those 1e-6. Empty: nothing is left. One part: inset of it.
/// \throws MeshError where something would be missing beyond kInsetWithin times the depth
std::vector<std::shared_ptr<const ConvexMesh>> inset_union(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth);

/// Of that, what lies in one of `within`, which are some of the parts: the layer of those alone,
/// under the surface that they have together with the others. It ends where they do.
std::vector<std::shared_ptr<const ConvexMesh>> inset_union_within(
    const std::vector<std::shared_ptr<const ConvexMesh>>& parts, double depth,
    const std::vector<std::shared_ptr<const ConvexMesh>>& within);

/// m; from about this depth on nothing is left: of the largest ball in one of the sets that
/// inset_union moves inwards.
double largest_inset(const std::vector<std::shared_ptr<const ConvexMesh>>& parts);

}  // namespace palpate::stimuli
