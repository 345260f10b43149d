#pragma once
// Internal to the search: by which facet of M, the Minkowski sum of object and mirrored probe, a
// probe comes in. By brute force: all facets and edges of the mesh are looked at.

#include <cstdint>
#include <optional>

#include "rendering/probe.h"
#include "rendering/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// Sizes of the object; depths this near may be those of neighbouring facets.
inline constexpr double kNeighbouringDepths = 1e-4;

/// Some facet's plane has both poses on its outer side, hence all poses between them.
bool plane_between(const stimuli::ConvexMesh& mesh, const LineProbe& before,
                   const LineProbe& after);

/// Outward normal and depth of one facet of M (a facet of the mesh with the deeper end, or an edge)
/// for a probe; edges that are no silhouette edges have none. Mesh frame.
std::optional<ReferenceDepth> facet_of_sum(const stimuli::ConvexMesh& mesh, bool is_edge,
                                           std::uint32_t i, const LineProbe& probe);

/// The one facet of M that the probe comes in by, where it is plain which one.
struct MinkowskiEntry {
  bool is_edge = false;
  std::uint32_t index = 0;
};
std::optional<MinkowskiEntry> entry_at(const stimuli::ConvexMesh& mesh, const LineProbe& probe);

}  // namespace palpate::rendering
