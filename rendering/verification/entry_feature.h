#pragma once
// Through which facet of M (facet_walk.h) a probe enters, by brute force over all facets and edges
// of the mesh. For the search for wrong ticks.

#include <cstdint>
#include <optional>

#include "rendering/probe.h"
#include "rendering/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// Sizes of the object; depths that differ by less may be those of neighbouring facets of M.
inline constexpr double kNeighbouringDepths = 1e-4;

/// Whether some facet's plane has both poses on its outer side, hence all poses between them.
bool separated_by_facet_plane(const stimuli::ConvexMesh& mesh, const LineProbe& before,
                              const LineProbe& after);

/// Outward normal and depth of one facet of M (a facet of the mesh with the deeper end, or an edge)
/// for a probe; edges that are no silhouette edges have none. Mesh frame.
std::optional<ReferenceDepth> measure_feature(const stimuli::ConvexMesh& mesh, bool is_edge,
                                              std::uint32_t i, const LineProbe& probe);

/// The facet of M through which the probe enters, where that is unambiguous.
struct EntryFeature {
  bool is_edge = false;
  std::uint32_t index = 0;
};
std::optional<EntryFeature> entry_feature(const stimuli::ConvexMesh& mesh, const LineProbe& probe);

}  // namespace palpate::rendering
