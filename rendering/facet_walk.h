#pragma once
// Neighbourhood watch: the next contact is looked for among the neighbours of the last one, so a
// tick costs the same whatever the number of polygons.

#include <bit>
#include <cstdint>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A facet of M, the Minkowski sum of the object and the mirrored probe: a facet of the object with
/// the deeper end of the probe, or a silhouette edge of the object with the probe's direction. One
/// word: it is copied at every step, and a word that was written in parts is slow to read back.
struct MinkowskiFacet {
  enum class Kind : std::uint32_t { none, face, edge };
  MinkowskiFacet() = default;
  MinkowskiFacet(Kind k, bool ahead, std::uint32_t i)
      : MinkowskiFacet(std::bit_cast<MinkowskiFacet>(static_cast<std::uint32_t>(k) |
                                                     std::uint32_t{ahead} << 2 | i << 3)) {}

  Kind kind : 2 = Kind::none;
  /// Edge only: which of its two faces turned towards the tail (dot(normal, d) >= 0) at the last
  /// tick.
  bool left_ahead : 1 = false;
  std::uint32_t index : 29 = 0;  ///< of the facet or edge in the mesh

  friend bool operator==(MinkowskiFacet a, MinkowskiFacet b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  }
};

/// Where a walk ended. Mesh frame.
struct WalkResult {
  MinkowskiFacet facet;      ///< kind none: the probe has left the object
  MinkowskiFacet separates;  ///< where it has left: the facet of M whose plane is between
  Vec3 normal;               ///< unit, outward, of `facet`; when left: of the plane that separates
  double depth = 0;          ///< m, along normal; negative when left
  double place = 0;       ///< fraction of the probe from the tip: 0 tip, 1 tail, between on an edge
  double along_edge = 0;  ///< edge only: where on it, as a fraction from v0
  /// No step helped, yet the ideal probe is off the facet: the probe has left the object, or edges
  /// nearly parallel to it hide the way. Look at all facets.
  bool unsure = false;
  bool capped = false;  ///< the limit of steps was met; the facet is valid but perhaps not the last
};

/// Walks from `start` to the facet of M that the probe is held by. Mesh frame.
/// \param tip   the virtual probe's tip, m
/// \param d     tail - tip, m; zero for a point
WalkResult walk_segment(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip,
                        const Vec3& d);

/// The same walk with the probe shrunk to its tip: faces only.
WalkResult walk_point(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip);

/// Asks for the memory two steps from a facet that the walk has come to, so that later walks need
/// not wait for it; changes nothing. What is one step away was asked for one facet before.
/// Neighbours of triangles only: other facets are few.
void fetch_ahead(const stimuli::ConvexMesh& mesh, MinkowskiFacet at);

/// The facet of M of least depth, by looking at all of them: where there is no history to walk
/// from. Costs O(facets + edges). Negative depth, kind none: the probe is outside.
WalkResult nearest_facet_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d);
WalkResult nearest_facet_point(const stimuli::ConvexMesh& mesh, const Vec3& tip);

/// Of the facets of M that hold the probe (with the ideal probe on them), the one whose ideal probe
/// is nearest to the virtual probe moved by `shift`; kind none: there is none. For walks that are
/// unsure. Costs O(facets + edges).
WalkResult holding_facet_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                                 const Vec3& shift);
WalkResult holding_facet_point(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& shift);

/// The plane of the facet of the last tick, wherever on it the probe is now: a walk of no steps.
WalkResult same_facet_segment(const stimuli::ConvexMesh& mesh, MinkowskiFacet start,
                              const Vec3& tip, const Vec3& d);
WalkResult same_facet_point(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip);

}  // namespace palpate::rendering
