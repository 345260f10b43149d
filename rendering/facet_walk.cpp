#include "rendering/facet_walk.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

// Ho, Basdogan & Srinivasan 2000, 4(b). Departs: the paper's rules are steps between adjacent
// facets of M (facet_walk.h), so one loop covers them all.
//
// A step over a violated side strictly lowers the depth as long as the depth is not negative, so
// the loop ends; a negative depth means a separating plane: the probe has left.

using namespace minkowski;

constexpr double kParallelSine = 1e-14;  // of the angle between probe and facet
constexpr double kOffTolerance = 1e-11;  // of the size; an ideal probe farther off is off the facet
constexpr std::size_t kFewSteps = 8;     // up to this many are not compared with the mesh
constexpr double kDepthRounding = 1e-15;  // of the size; a smaller gain is rounding, not a step

/// From a facet over one of its sides: to the edge where it is a silhouette edge, else to the next
/// facet.
template <bool kSegment>
[[gnu::always_inline]] inline Measured step_from_facet(const stimuli::ConvexMesh& mesh,
                                                       const Measured& from,
                                                       const stimuli::Neighbour& side,
                                                       const Vec3& tip, const Vec3& d) {
  Measured next = measure_facet<kSegment>(mesh, side.across, tip, d);
  if constexpr (kSegment) {
    const bool here = from.slope >= 0, there = next.slope >= 0;
    if (here != there) {
      const bool left_ahead = (mesh.edges()[side.edge].left == from.index) == here;
      Measured between;
      if (measure_edge(mesh, side.edge, left_ahead, tip, d, between)) return between;
    }
  }
  return next;
}

/// From an edge past an end of the probe (to the facet ahead or behind) or past an end of the edge
/// (to the next silhouette edge). False when the contact point is within both.
[[gnu::always_inline]] inline bool step_from_edge(const stimuli::ConvexMesh& mesh,
                                                  const Measured& at, const Vec3& tip,
                                                  const Vec3& d, Measured& next) {
  if (at.within) return false;
  const stimuli::Edge& edge = mesh.edges()[at.index];
  if (at.probe_fraction < 0 || at.probe_fraction > 1) {
    const bool to_left = (at.probe_fraction < 0) == at.left_ahead;
    next = measure_facet<true>(mesh, to_left ? edge.left : edge.right, tip, d);
    return true;
  }
  if (at.edge_fraction < 0 || at.edge_fraction > 1) {
    const bool about_v1 = at.edge_fraction > 1;
    const SilhouetteEdge other = other_silhouette(mesh, at.index, about_v1, at.left_ahead, d);
    if (other.edge == kNone) {
      next = at;  // no step
      return true;
    }
    if (measure_edge(mesh, other.edge, other.left_ahead, tip, d, next)) return true;
    // The edge is parallel to the probe: both of its facets have the same depth there.
    next = measure_facet<true>(mesh, mesh.edges()[other.edge].left, tip, d);
    return true;
  }
  return false;
}

/// The feature that the last tick ended on, measured against the probe of this tick. Inlined, as is
/// each step: a call costs the walk of a tick 2 % of its instructions.
template <bool kSegment>
[[gnu::always_inline]] inline Measured resume(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                              const Vec3& tip, const Vec3& d) {
  if constexpr (kSegment) {
    if (start.kind == Kind::edge) {
      const stimuli::Edge& edge = mesh.edges()[start.index];
      const Slopes slopes = slopes_at(mesh, edge, d);
      Measured m;
      if (slopes.silhouette() && measure_edge(mesh, start.index, slopes.left >= 0, tip, d, m))
        return m;
      // The probe has turned past one of the two facets: there the edge's normal had become that
      // facet's normal, so taking that facet keeps the force continuous.
      const bool both_ahead = slopes.left >= 0 && slopes.right >= 0;
      const bool left_turned = start.left_ahead != both_ahead;
      return measure_facet<true>(mesh, left_turned ? edge.left : edge.right, tip, d);
    }
  }
  return measure_facet<kSegment>(mesh, start.index, tip, d);
}

// gcc drops calls of a function that only prefetches: it must be inlined.
template <bool kEdges>
[[gnu::always_inline]] inline void prefetch_beyond(const stimuli::ConvexMesh& mesh,
                                                   std::uint32_t facet) {
  for (const stimuli::Neighbour& next : mesh.facets()[facet].triangle) {
    __builtin_prefetch(&mesh.facets()[next.across]);
    if constexpr (kEdges) __builtin_prefetch(&mesh.edges()[next.edge]);
  }
}

[[gnu::always_inline]] inline WalkResult to_result(const Measured& at, bool capped) {
  const ContactFeature feature(at.edge ? Kind::edge : Kind::facet, at.left_ahead, at.index);
  const bool held = at.depth >= 0;
  return {.feature = held ? feature : ContactFeature(),
          .separating_feature = held ? ContactFeature() : feature,
          .normal = at.normal,
          .depth = at.depth,
          .probe_fraction = at.probe_fraction < 0   ? 0
                            : at.probe_fraction > 1 ? 1
                                                    : at.probe_fraction,
          .edge_fraction = at.edge_fraction,
          .capped = capped};
}

// Rare. Takes a copy: a value passed by reference stays in memory for the whole walk.
template <bool kSegment>
[[gnu::cold, gnu::noinline]] bool is_off_facet(const stimuli::ConvexMesh& mesh, Measured at,
                                               const Vec3& tip, const Vec3& d) {
  return distance_off<kSegment>(mesh, at, tip, d) > kOffTolerance * (mesh.size() + glm::length(d));
}

/// Parallel within rounding: the deeper end is undefined, and either end may be past the facet.
bool parallel_to_facet(double slope, const Vec3& d) {
  return slope * slope <= kParallelSine * kParallelSine * glm::dot(d, d);
}

/// \tparam kOutside  continue past a separating plane while the next one is farther from the probe
template <bool kSegment, bool kOutside = false>
[[gnu::always_inline]] inline WalkResult walk(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                              const Vec3& tip, const Vec3& d) {
  const double gain = kDepthRounding * mesh.size();
  Measured at = resume<kSegment>(mesh, start, tip, d);
  bool capped = false, stalled = false;
  std::size_t steps = 0;
  while (kOutside || at.depth >= 0) {
    Measured next;
    if (kSegment && at.edge) {
      if (!step_from_edge(mesh, at, tip, d, next)) break;
    } else {
      const Vec3 end = kSegment && at.probe_fraction > 0 ? tip + d : tip;
      const stimuli::Neighbour side = beyond_side(mesh, at.index, end + at.depth * at.normal);
      if (side.edge == kNone) break;
      if (kSegment && parallel_to_facet(at.slope, d) && !is_off_facet<kSegment>(mesh, at, tip, d))
        break;
      next = step_from_facet<kSegment>(mesh, at, side, tip, d);
    }
    if (!(next.depth < at.depth - gain)) {
      stalled = true;
      break;
    }
    at = next;
    // A straight path across the object visits some sqrt(facets) of them.
    if (++steps > kFewSteps && steps > mesh.facets().size() + mesh.edges().size()) {
      capped = true;
      break;
    }
  }
  WalkResult result = to_result(at, capped);
  if (stalled || at.nearly_parallel) [[unlikely]] {
    result.not_converged = at.depth >= 0 && is_off_facet<kSegment>(mesh, at, tip, d);
  }
  return result;
}

template <bool kSegment>
WalkResult nearest_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d) {
  Measured nearest = measure_facet<kSegment>(mesh, 0, tip, d);
  for (std::uint32_t i = 1; i < mesh.facets().size(); ++i) {
    const Measured m = measure_facet<kSegment>(mesh, i, tip, d);
    if (m.depth < nearest.depth) nearest = m;
  }
  if constexpr (kSegment) {
    for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
      const Slopes slopes = slopes_at(mesh, mesh.edges()[i], d);
      Measured m;
      if (slopes.silhouette() && measure_edge(mesh, i, slopes.left >= 0, tip, d, m) &&
          m.depth < nearest.depth) {
        nearest = m;
      }
    }
  }
  return to_result(nearest, false);
}

template <bool kSegment>
WalkResult holding_feature(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                           const Vec3& shift) {
  WalkResult best;
  double nearest = HUGE_VAL;
  const auto consider = [&](const Measured& m) {
    if (!(m.depth >= 0) || is_off_facet<kSegment>(mesh, m, tip, d)) return;
    const Vec3 beside = m.depth * m.normal - shift;
    if (!(glm::dot(beside, beside) < nearest)) return;
    nearest = glm::dot(beside, beside);
    best = to_result(m, false);
  };
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i) {
    consider(measure_facet<kSegment>(mesh, i, tip, d));
  }
  if constexpr (kSegment) {
    for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
      const Slopes slopes = slopes_at(mesh, mesh.edges()[i], d);
      Measured m;
      if (slopes.silhouette() && measure_edge(mesh, i, slopes.left >= 0, tip, d, m)) consider(m);
    }
  }
  return best;
}

}  // namespace

WalkResult holding_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                                   const Vec3& shift) {
  return holding_feature<true>(mesh, tip, d, shift);
}

WalkResult holding_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip,
                                 const Vec3& shift) {
  return holding_feature<false>(mesh, tip, Vec3(0), shift);
}

WalkResult walk_segment(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                        const Vec3& d) {
  return walk<true>(mesh, start, tip, d);
}

WalkResult walk_point(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip) {
  return walk<false>(mesh, start, tip, Vec3(0));
}

WalkResult farthest_plane_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                  const Vec3& tip, const Vec3& d) {
  return walk<true, true>(mesh, start, tip, d);
}

WalkResult farthest_plane_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip) {
  return walk<false, true>(mesh, start, tip, Vec3(0));
}

void prefetch_neighbours(const stimuli::ConvexMesh& mesh, ContactFeature at) {
  if (at.kind == Kind::facet) {
    for (const stimuli::Neighbour& next : mesh.facets()[at.index].triangle)
      prefetch_beyond<false>(mesh, next.across);
    return;
  }
  for (const std::uint32_t facet : {mesh.edges()[at.index].left, mesh.edges()[at.index].right}) {
    for (const stimuli::Neighbour& next : mesh.facets()[facet].triangle) {
      if (next.edge == at.index) continue;
      prefetch_beyond<true>(mesh, next.across);
    }
  }
}

WalkResult same_feature_segment(const stimuli::ConvexMesh& mesh, ContactFeature start,
                                const Vec3& tip, const Vec3& d) {
  return to_result(resume<true>(mesh, start, tip, d), false);
}

WalkResult same_feature_point(const stimuli::ConvexMesh& mesh, ContactFeature start,
                              const Vec3& tip) {
  return to_result(resume<false>(mesh, start, tip, Vec3(0)), false);
}

WalkResult nearest_feature_segment(const stimuli::ConvexMesh& mesh, const Vec3& tip,
                                   const Vec3& d) {
  return nearest_feature<true>(mesh, tip, d);
}

WalkResult nearest_feature_point(const stimuli::ConvexMesh& mesh, const Vec3& tip) {
  return nearest_feature<false>(mesh, tip, Vec3(0));
}

}  // namespace palpate::rendering
