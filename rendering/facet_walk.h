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

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/contact_feature.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

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

/// Walks from a facet of M whose plane separates the probe to one whose plane is farther from the
/// probe than those of its neighbours. That facet is under the probe; the next contact is near it.
WalkResult farthest_plane_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                  const Vec3& tip, const Vec3& d);
WalkResult farthest_plane_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip);

/// Prefetches the memory two steps away from a feature that a walk has reached; changes nothing.
/// The memory one step away was prefetched at the previous feature. Neighbours of triangles only:
/// other facets are few.
void prefetch_neighbours(const stimuli::ConvexMesh& mesh, ContactFeature at);

/// The penetration depth, the least over all facets of M, for cases without a history to walk from.
/// Costs O(facets + edges). Negative depth, kind none: the probe is outside.
WalkResult nearest_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d);
WalkResult nearest_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip);

/// Among the facets of M that the ideal probe can lie on, finds the one whose ideal probe is
/// nearest to the virtual probe moved by `shift`. Kind none: there is no such facet. For walks that
/// did not converge. Costs O(facets + edges).
WalkResult holding_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                                   const Vec3& shift);
WalkResult holding_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip,
                                 const Vec3& shift);

/// Depth below the plane of the last tick's feature, wherever the probe is now: a walk without
/// steps.
WalkResult same_feature_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip, const Vec3& d);
WalkResult same_feature_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                              const Vec3& tip);

}  // namespace palpate::rendering

// The facets of M, the Minkowski sum of the object and the mirrored probe: normal,
// penetration depth and contact point for a given probe, and which ones are adjacent. Mesh frame,
// SI units; d = tail - tip. Internal to the walks: facet_walk.cpp and contact_detection.cpp.
namespace palpate::rendering::minkowski {

using Kind = ContactFeature::Kind;

inline constexpr std::uint32_t kNone = ~0u;
inline constexpr std::uint32_t kScanSides = 12;  // more sides than this are searched by bisection
inline constexpr double kParallel = 1e-9;        // |e x d| / (|e| |d|) below this: no contact edge
inline constexpr double kNearlyParallel =
    1e-3;  // below this the direction of e x d has lost digits

/// Where a side of the facet begins.
inline const Vec3& corner(const stimuli::ConvexMesh& mesh, std::uint32_t facet,
                          const stimuli::Side& side) {
  const stimuli::Edge& edge = mesh.edges()[side.edge];
  return edge.left == facet ? edge.from : edge.to;
}

inline bool outside(const stimuli::Side& side, const Vec3& p) {
  return glm::dot(side.inward, p) < side.offset;
}

/// As beyond_side, for a polygon with many sides: bisection over the fan of triangles at corner 0,
/// so a cap of a thousand sides costs ten comparisons.
inline stimuli::Neighbour beyond_many(const stimuli::ConvexMesh& mesh, std::uint32_t index,
                                      const Vec3& p) {
  const stimuli::Facet& facet = mesh.facets()[index];
  const stimuli::Side* sides = &mesh.sides()[facet.first_side];
  const std::uint32_t count = facet.side_count;
  const auto beyond = [&](std::uint32_t i) {
    return stimuli::Neighbour{sides[i].edge, sides[i].across};
  };
  if (outside(sides[0], p)) return beyond(0);
  if (outside(sides[count - 1], p)) return beyond(count - 1);
  const Vec3 apex = corner(mesh, index, sides[0]);
  const Vec3 turn = glm::cross(facet.normal, p - apex);  // in-plane, a quarter turn ahead of p
  std::uint32_t low = 1, high = count - 1;  // p lies between the rays to corner low and corner high
  while (high - low > 1) {
    const std::uint32_t middle = (low + high) / 2;
    const Vec3 ray = corner(mesh, index, sides[middle]) - apex;
    (glm::dot(ray, turn) <= 0 ? low : high) = middle;
  }
  return outside(sides[low], p) ? beyond(low) : stimuli::Neighbour{kNone, kNone};
}

/// The same for a triangle. A point past a side is above the plane of the facet beyond it, which
/// the next step reads anyway. One branch: on a coarse mesh the processor can predict whether p is
/// past any side; on no mesh can it predict which.
inline stimuli::Neighbour beyond_triangle(const stimuli::ConvexMesh& mesh,
                                          const stimuli::Facet& facet, const Vec3& p) {
  std::array<double, 3> height;
  for (std::size_t i = 0; i < 3; ++i) {
    const stimuli::Facet& across = mesh.facets()[facet.triangle[i].across];
    height[i] = glm::dot(across.normal, p) - across.offset;
  }
  const double highest = std::max(height[0], height[1]);
  if (!(std::max(highest, height[2]) > 0)) return {kNone, kNone};
  const unsigned second = height[1] > height[0];
  const unsigned third = height[2] > highest;
  return facet.triangle[2 * third + (second & ~third)];
}

/// The neighbour beyond the side that p, a point of the facet's plane, is past; edge kNone when p
/// is inside.
inline stimuli::Neighbour beyond_side(const stimuli::ConvexMesh& mesh, std::uint32_t index,
                                      const Vec3& p) {
  const stimuli::Facet& facet = mesh.facets()[index];
  if (facet.side_count == 3) return beyond_triangle(mesh, facet, p);
  if (facet.side_count > kScanSides) return beyond_many(mesh, index, p);
  stimuli::Neighbour beyond{kNone, kNone};
  double worst = 0;
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    const double distance = side.offset - glm::dot(side.inward, p);
    if (distance > worst) {
      worst = distance;
      beyond = {side.edge, side.across};
    }
  }
  return beyond;
}

/// One facet of M measured against the probe.
struct Measured {
  bool edge = false;             ///< else a facet of the object
  bool left_ahead = false;       ///< edge only, as in ContactFeature
  bool nearly_parallel = false;  ///< edge only: nearly parallel to the probe
  bool within = false;           ///< edge only: the contact point is between the ends of both
  std::uint32_t index = 0;
  Vec3 normal;                ///< unit, outward
  double depth = 0;           ///< m; negative: the plane separates
  double slope = 0;           ///< facet only: dot(normal, d), m
  double probe_fraction = 0;  ///< of the contact point: 0 tip to 1 tail, unclamped
  double edge_fraction = 0;   ///< edge only: of the contact point: 0 at v0 to 1 at v1, unclamped
};

template <bool kSegment>
Measured measure_facet(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& tip,
                       const Vec3& d) {
  const stimuli::Facet& facet = mesh.facets()[index];
  Measured m;
  m.index = index;
  m.normal = facet.normal;
  const double height = facet.offset - glm::dot(facet.normal, tip);
  if constexpr (kSegment) {
    m.slope = glm::dot(facet.normal, d);
    m.probe_fraction = m.slope >= 0 ? 0.0 : 1.0;
    m.depth = m.slope >= 0 ? height : height - m.slope;
  } else {
    m.depth = height;
  }
  return m;
}

struct Slopes {
  double left, right;  ///< m, dot(normal, d) of the edge's two facets
  bool silhouette() const { return (left >= 0) != (right >= 0); }
};

inline Slopes slopes_at(const stimuli::ConvexMesh& mesh, const stimuli::Edge& edge, const Vec3& d) {
  return {glm::dot(mesh.facets()[edge.left].normal, d),
          glm::dot(mesh.facets()[edge.right].normal, d)};
}

/// The normal of an edge as the mixture of its facets' normals that is at right angles to d:
/// however small e x d is, it stays between the two.
[[gnu::cold, gnu::noinline]] inline Vec3 mixed_normal(const stimuli::ConvexMesh& mesh,
                                                      const stimuli::Edge& edge, const Vec3& d) {
  const Slopes slopes = slopes_at(mesh, edge, d);
  return glm::normalize(std::abs(slopes.right) * mesh.facets()[edge.left].normal +
                        std::abs(slopes.left) * mesh.facets()[edge.right].normal);
}

/// False where the edge and the probe are parallel: then it is not a contact edge.
inline bool measure_edge(const stimuli::ConvexMesh& mesh, std::uint32_t index, bool left_ahead,
                         const Vec3& tip, const Vec3& d, Measured& m) {
  const stimuli::Edge& edge = mesh.edges()[index];
  const Vec3& v0 = edge.from;
  const Vec3 e = edge.to - v0;
  const Vec3 c = glm::cross(e, d);
  const double c2 = glm::dot(c, c);
  const double right_angle2 = glm::dot(e, e) * glm::dot(d, d);
  if (c2 <= kParallel * kParallel * right_angle2) return false;
  const double inverse = 1 / c2;
  const double scale = std::copysign(inverse, left_ahead - 0.5) * std::sqrt(c2);
  const Vec3 w = tip - v0;
  m.edge = true;
  m.left_ahead = left_ahead;
  m.index = index;
  m.normal = scale * c;  // outward: the facet ahead faces the tail, the other one the tip
  if (c2 < kNearlyParallel * kNearlyParallel * right_angle2) [[unlikely]] {
    m.nearly_parallel = true;
    m.normal = mixed_normal(mesh, edge, d);
  }
  m.depth = -glm::dot(m.normal, w);
  // w + depth n + s d = u e, with s and u the fractions, crossed with e and with d
  const double s = glm::dot(glm::cross(w, e), c), u = glm::dot(glm::cross(w, d), c);
  // Compare before dividing: the decision to step need not wait for a division.
  m.within = (s >= 0) & (s <= c2) & (u >= 0) & (u <= c2);
  m.probe_fraction = s * inverse;
  m.edge_fraction = u * inverse;
  return true;
}

/// A silhouette edge and which of its facets is ahead.
struct SilhouetteEdge {
  std::uint32_t edge = kNone;
  bool left_ahead = false;
};

/// The other silhouette edge at one end of the silhouette edge `from`: around a vertex the sign of
/// dot(normal, d) changes exactly twice. Turns about the vertex counter-clockwise, from facet to
/// facet, until the sign changes. Edge kNone when rounding hides the second one, or where not all
/// facets are triangles.
inline SilhouetteEdge turn_about(const stimuli::ConvexMesh& mesh, std::uint32_t from, bool about_v1,
                                 bool left_ahead, const Vec3& d) {
  // Out of the facet on the left the next side starts at v1, out of the one on the right at v0.
  const bool ahead = about_v1 == left_ahead;
  std::uint32_t edge = from;
  const stimuli::Facet* facet =
      &mesh.facets()[about_v1 ? mesh.edges()[from].left : mesh.edges()[from].right];
  while (facet->side_count == 3) {
    const auto& sides = facet->triangle;
    const stimuli::Neighbour& next = sides[edge == sides[0].edge   ? 1
                                           : edge == sides[1].edge ? 2
                                                                   : 0];
    edge = next.edge;
    if (edge == from) return {};
    const stimuli::Facet* across = &mesh.facets()[next.across];
    if ((glm::dot(across->normal, d) >= 0) != ahead) {
      const bool facet_is_left = facet == &mesh.facets()[mesh.edges()[edge].left];
      return {edge, facet_is_left == ahead};
    }
    facet = across;
  }
  return {};
}

/// The same by a search through the vertex's fan.
inline SilhouetteEdge search_fan(const stimuli::ConvexMesh& mesh, std::uint32_t from, bool about_v1,
                                 const Vec3& d) {
  const std::uint32_t vertex = about_v1 ? mesh.edges()[from].v1 : mesh.edges()[from].v0;
  for (std::uint32_t i = mesh.fan_first()[vertex]; i < mesh.fan_first()[vertex + 1]; ++i) {
    const std::uint32_t candidate = mesh.fan_edges()[i];
    const Slopes slopes = slopes_at(mesh, mesh.edges()[candidate], d);
    if (candidate != from && slopes.silhouette()) return {candidate, slopes.left >= 0};
  }
  return {};
}

/// The other silhouette edge at one end of the silhouette edge `from`. Edge kNone where rounding
/// hides it.
inline SilhouetteEdge other_silhouette(const stimuli::ConvexMesh& mesh, std::uint32_t from,
                                       bool about_v1, bool left_ahead, const Vec3& d) {
  const SilhouetteEdge other = turn_about(mesh, from, about_v1, left_ahead, d);
  return other.edge != kNone ? other : search_fan(mesh, from, about_v1, d);
}

/// m, from p to the segment a .. a + along.
inline double distance_to(const Vec3& p, const Vec3& a, const Vec3& along) {
  const double fraction = std::clamp(glm::dot(p - a, along) / glm::dot(along, along), 0.0, 1.0);
  return glm::length(a + fraction * along - p);
}

/// m, from the ideal probe to the polygon that it should touch.
template <bool kSegment>
double distance_off_facet(const stimuli::ConvexMesh& mesh, const Measured& at, const Vec3& tip,
                          const Vec3& d) {
  const stimuli::Facet& facet = mesh.facets()[at.index];
  const bool tail = kSegment && at.probe_fraction > 0;
  const Vec3 end = (tail ? tip + d : tip) + at.depth * at.normal;
  // A point inside a triangle is below the planes beyond its sides, which walks have read already.
  if (facet.side_count == 3 && beyond_triangle(mesh, facet, end).edge == kNone) return 0;
  const Vec3 along = tail ? -d : d;
  double past = 0, enter = 0, leave = 1;
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    const double inside = glm::dot(side.inward, end) - side.offset;
    const double slope = glm::dot(side.inward, along);
    past = std::max(past, -inside);
    if (slope > 0) enter = std::max(enter, -inside / slope);
    if (slope < 0) leave = std::min(leave, inside / -slope);
    if (slope == 0 && inside < 0) leave = -1;
  }
  // A probe parallel to the facet may touch it although its end is past a side.
  if (enter <= leave) past = std::min(past, enter * std::abs(glm::dot(facet.normal, along)));
  return past;
}

/// m, from the ideal probe to the edge that it should touch.
inline double distance_off_edge(const stimuli::ConvexMesh& mesh, const Measured& at,
                                const Vec3& tip, const Vec3& d) {
  const stimuli::Edge& edge = mesh.edges()[at.index];
  const Vec3& v0 = edge.from;
  const Vec3 e = edge.to - v0;
  const Vec3 ideal = tip + at.depth * at.normal;
  return std::min(distance_to(ideal + std::clamp(at.probe_fraction, 0.0, 1.0) * d, v0, e),
                  distance_to(v0 + std::clamp(at.edge_fraction, 0.0, 1.0) * e, ideal, d));
}

/// m, from the ideal probe to the feature that it should touch. Above rounding, the probe is off
/// the facet of M.
template <bool kSegment>
[[gnu::cold, gnu::noinline]] double distance_off(const stimuli::ConvexMesh& mesh,
                                                 const Measured& at, const Vec3& tip,
                                                 const Vec3& d) {
  if (kSegment && at.edge) return distance_off_edge(mesh, at, tip, d);
  return distance_off_facet<kSegment>(mesh, at, tip, d);
}

}  // namespace palpate::rendering::minkowski
