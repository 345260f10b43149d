#pragma once
// The walk that keeps a god-object: from the contact feature of the last tick to its neighbours,
// downhill in penetration depth, so that a tick costs the same whatever the number of polygons
// (the "neighborhood watch" of Ho, Basdogan & Srinivasan 2000, section 4(b)).
//
// For a fixed orientation of the probe, the translations that bring the segment S into touch with
// the convex object C are the boundary of their Minkowski sum M = C (+) (-S). M is convex. Its
// facets, here "facets of M", are contact features of two kinds: a facet of C with the deeper end
// of S, and a silhouette edge of C (seen along S) with the direction of S. The ideal probe
// (god-object) is the virtual probe moved along the normal of one facet of M onto its plane.
//
// Mesh frame, SI units throughout.

#include <bit>
#include <cstdint>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// A facet of M, by the feature of the object that it comes from. One word: it is copied at every
/// step, and a word that was written in parts is slow to read back.
struct ContactFeature {
  enum class Kind : std::uint32_t {
    none,   ///< no contact
    facet,  ///< of the object, with the deeper end of the probe
    edge,   ///< silhouette edge of the object, with the direction of the probe
  };
  ContactFeature() = default;
  ContactFeature(Kind k, bool ahead, std::uint32_t i)
      : ContactFeature(std::bit_cast<ContactFeature>(static_cast<std::uint32_t>(k) |
                                                     std::uint32_t{ahead} << 2 | i << 3)) {}

  Kind kind : 2 = Kind::none;
  /// Edge only: which of its two facets faced the tail (dot(normal, d) >= 0, d = tail - tip) at the
  /// last tick.
  bool left_ahead : 1 = false;
  std::uint32_t index : 29 = 0;  ///< of the facet or edge, in the mesh

  friend bool operator==(ContactFeature a, ContactFeature b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  }
};

/// Where a walk ended.
struct WalkResult {
  ContactFeature feature;             ///< kind none: the probe has left the object
  ContactFeature separating_feature;  ///< when left: the facet of M whose plane separates
  Vec3 normal;                ///< unit, outward, of `feature`; when left: of the separating plane
  double depth = 0;           ///< m, penetration along normal; negative when left
  double probe_fraction = 0;  ///< of the contact point on the probe: 0 tip to 1 tail
  double edge_fraction = 0;   ///< edge only: of the contact point on it: 0 at v0 to 1 at v1
  /// No step lowered the depth, yet the ideal probe is off the facet of M: the probe has left the
  /// object, or edges nearly parallel to it hide the next step. Look at all features.
  bool not_converged = false;
  bool capped = false;  ///< stopped at the limit of steps; the feature may not be the final one
};

/// Walks from `start` to the facet of M that holds the ideal probe.
/// \param tip   the virtual probe's tip, m
/// \param d     tail - tip, m; zero for a point
WalkResult walk_segment(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                        const Vec3& d);

/// The same walk with the probe shrunk to its tip: facets of the object only.
WalkResult walk_point(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip);

/// From a facet of M whose plane separates the probe over neighbours to one whose plane is farther
/// from it than theirs: it is under the probe, and the next contact is near.
WalkResult farthest_plane_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                  const Vec3& tip, const Vec3& d);
WalkResult farthest_plane_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip);

/// Prefetches the memory two steps from a feature that the walk has come to; changes nothing. What
/// is one step away was prefetched one feature before. Neighbours of triangles only: other facets
/// are few.
void prefetch_neighbours(const stimuli::ConvexMesh& mesh, ContactFeature at);

/// The penetration depth: the least over all facets of M, where there is no history to walk from.
/// Costs O(facets + edges). Negative depth, kind none: the probe is outside.
WalkResult nearest_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d);
WalkResult nearest_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip);

/// Of the facets of M that the ideal probe can lie on, the one whose ideal probe is nearest to the
/// virtual probe moved by `shift`; kind none: there is none. For walks that did not converge. Costs
/// O(facets + edges).
WalkResult holding_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                                   const Vec3& shift);
WalkResult holding_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip,
                                 const Vec3& shift);

/// Depth below the plane of the feature of the last tick, wherever on it the probe is now: a walk
/// of no steps.
WalkResult same_feature_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip, const Vec3& d);
WalkResult same_feature_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                              const Vec3& tip);

}  // namespace palpate::rendering
