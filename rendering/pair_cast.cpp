#include "rendering/pair_cast.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/minkowski_facets.h"
#include "rendering/separation.h"

namespace palpate::rendering {
namespace {

using namespace minkowski;

constexpr double kPoint = 1e-12;  // of the size; a shorter segment is a point
constexpr double kOnBorder =
    1e-11;                        // of the size; a segment that is no farther off is on the facet
constexpr int kStalledSteps = 8;  // without a later time: rounding; every facet is looked at

bool is_point(const stimuli::ConvexMesh& mesh, const Vec3& d) {
  const double least = kPoint * mesh.size();
  return glm::dot(d, d) <= least * least;
}

/// A feature that the segment was at, for the point that it has shrunk to: no edge.
template <bool kSegment>
ContactFeature usable(const stimuli::ConvexMesh& mesh, ContactFeature feature) {
  if (kSegment || feature.kind != Kind::edge) return feature;
  return {Kind::facet, false, mesh.edges()[feature.index].left};
}

ContactFeature feature_of(const Measured& at) {
  return {at.edge ? Kind::edge : Kind::facet, at.left_ahead, at.index};
}

template <bool kSegment>
Measured measured(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                  const Vec3& d) {
  Measured at;
  if (kSegment && feature.kind == Kind::edge &&
      measure_edge(mesh, feature.index, feature.left_ahead, tip, d, at))
    return at;
  return measure_facet<kSegment>(mesh, usable<false>(mesh, feature).index, tip, d);
}

/// A vertex far along `direction`.
std::uint32_t vertex_under(const CastMesh& part, const Vec3& direction) {
  const Vec3 along = glm::dot(direction, direction) > 0 ? direction : Vec3(1, 0, 0);
  const SupportMap* const map = part.trees.support_map();
  return support_vertex(part.mesh, along, map != nullptr ? map->near_support(along) : 0);
}

template <bool kSegment>
WalkResult walked(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                  const Vec3& d) {
  if constexpr (kSegment) return walk_segment(mesh, start, tip, d);
  return walk_point(mesh, start, tip);
}

/// Every facet of M, for lines that rounding does not let step on.
template <bool kSegment>
PairCast scan(const CastMesh& part, const Vec3& tip, const Vec3& d, const Vec3& motion) {
  ++part.full_scans;
  const stimuli::ConvexMesh& mesh = part.mesh;
  PairCast out;
  double enter = -HUGE_VAL, leave = 1;
  bool missed = false;
  ContactFeature separating;
  const auto clip = [&](const Measured& at) {
    const double height = -at.depth, rate = glm::dot(at.normal, motion);
    if (height >= 0 && height + rate >= 0) {
      missed = true;
      separating = feature_of(at);
    } else if (rate < 0) {
      const double time = height / -rate;
      if (time > enter) out.feature = feature_of(at);
      enter = std::max(enter, time);
    } else if (rate > 0) {
      leave = std::min(leave, height / -rate);
    }
  };
  for (std::uint32_t i = 0; i < mesh.facets().size(); ++i)
    clip(measure_facet<kSegment>(mesh, i, tip, d));
  if constexpr (kSegment) {
    for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
      const Slopes slopes = slopes_at(mesh, mesh.edges()[i], d);
      Measured at;
      if (slopes.silhouette() && measure_edge(mesh, i, slopes.left >= 0, tip, d, at)) clip(at);
    }
  }
  if (missed) out.feature = separating;
  out.hit = !missed && enter <= leave && enter < 1 && leave >= 0;
  out.time = std::max(0.0, enter);
  return out;
}

/// What is adjacent to an edge where the segment is past one of its ends, or past an end of the
/// edge. False where it is on it, or where rounding hides what comes next.
bool beyond_edge(const stimuli::ConvexMesh& mesh, const Measured& at, const Vec3& tip,
                 const Vec3& d, Measured& next) {
  const stimuli::Edge& edge = mesh.edges()[at.index];
  if (at.probe_fraction < 0 || at.probe_fraction > 1) {
    const bool to_left = (at.probe_fraction < 0) == at.left_ahead;
    next = measure_facet<true>(mesh, to_left ? edge.left : edge.right, tip, d);
    return true;
  }
  const SilhouetteEdge other =
      other_silhouette(mesh, at.index, at.edge_fraction > 1, at.left_ahead, d);
  if (other.edge == kNone) return false;
  if (!measure_edge(mesh, other.edge, other.left_ahead, tip, d, next))
    next = measure_facet<true>(mesh, mesh.edges()[other.edge].left, tip, d);
  return true;
}

/// The facet of M past the side of `at` that the segment, on its plane, is past.
template <bool kSegment>
bool beyond(const stimuli::ConvexMesh& mesh, const Measured& at, const Vec3& tip, const Vec3& d,
            Measured& next) {
  if (kSegment && at.edge) return !at.within && beyond_edge(mesh, at, tip, d, next);
  const Vec3 end = kSegment && at.probe_fraction > 0 ? tip + d : tip;
  const stimuli::Neighbour side = beyond_side(mesh, at.index, end);
  if (side.edge == kNone) return false;
  next = measure_facet<kSegment>(mesh, side.across, tip, d);
  if constexpr (kSegment) {
    const bool here = at.slope >= 0, there = next.slope >= 0;
    Measured edge;
    if (here != there &&
        measure_edge(mesh, side.edge, (mesh.edges()[side.edge].left == at.index) == here, tip, d,
                     edge))
      next = edge;
  }
  return true;
}

/// Whether the segment is no farther past the facet of M than a few more of its kind are wide:
/// then stepping there is less than looking elsewhere.
template <bool kSegment>
bool is_near(const stimuli::ConvexMesh& mesh, const Measured& at, const Vec3& tip, const Vec3& d) {
  constexpr double kWidths = 4;
  if (kSegment && at.edge)
    return std::abs(at.edge_fraction - 0.5) < kWidths && at.probe_fraction > -1 &&
           at.probe_fraction < 2;
  const stimuli::Facet& facet = mesh.facets()[at.index];
  if (facet.side_count != 3) return true;
  const stimuli::Edge& edge = mesh.edges()[facet.triangle[0].edge];
  const Vec3 e = edge.to - edge.from;
  const Vec3 to = (kSegment && at.probe_fraction > 0 ? tip + d : tip) - edge.from;
  const double up = glm::dot(to, at.normal);
  return glm::dot(to, to) - up * up < kWidths * kWidths * glm::dot(e, e);
}

/// A facet of M near the segment.
template <bool kSegment>
Measured facing(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
                const Vec3& out) {
  const stimuli::ConvexMesh& mesh = part.mesh;
  if (start.kind != Kind::none) {
    Measured known = measured<kSegment>(mesh, start, tip, d);
    if (glm::dot(known.normal, out) > 0 &&
        (part.trees.support_map() == nullptr || is_near<kSegment>(mesh, known, tip, d)))
      return known;
  }
  if (const FacetMap* const map = part.trees.facet_map(); map != nullptr) {
    Measured under = measure_facet<kSegment>(mesh, map->facet_under(tip, d), tip, d);
    if (glm::dot(under.normal, out) > 0) return under;
  }
  const std::uint32_t vertex = vertex_under(part, out);
  std::uint32_t best = mesh.edges()[mesh.fan_edges()[mesh.fan_first()[vertex]]].left;
  for (std::uint32_t i = mesh.fan_first()[vertex]; i < mesh.fan_first()[vertex + 1]; ++i) {
    const stimuli::Edge& edge = mesh.edges()[mesh.fan_edges()[i]];
    for (const std::uint32_t facet : {edge.left, edge.right}) {
      if (glm::dot(mesh.facets()[facet].normal, out) > glm::dot(mesh.facets()[best].normal, out))
        best = facet;
    }
  }
  return measure_facet<kSegment>(mesh, best, tip, d);
}

/// The facet of M through which the way from its middle to the segment leaves M: its plane
/// separates the segment if any does. False where rounding hides it.
template <bool kSegment>
bool outward_facet(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
                   Measured& at) {
  const stimuli::ConvexMesh& mesh = part.mesh;
  const Vec3 middle = part.inside - 0.5 * d;
  const Vec3 way = tip - middle;
  at = facing<kSegment>(part, start, tip, d, way);
  double time = 1;  // of the way; falls from facet to facet
  Vec3 at_tip = tip;
  int stalled = 0;
  const std::size_t most = mesh.facets().size() + mesh.edges().size();
  for (std::size_t step = 0; step < most; ++step) {
    const double rate = glm::dot(at.normal, way);
    if (!(rate > 0)) return false;
    const double earlier =
        step == 0 ? time + at.depth / rate : std::min(time, time + at.depth / rate);
    if (earlier < 1 && step > 0 && !(earlier < time) && ++stalled > kStalledSteps) return false;
    time = earlier;
    if (time < 1) {
      // It leaves before the segment: this plane separates already.
      at = measured<kSegment>(mesh, feature_of(at), tip, d);
      return true;
    }
    at_tip = middle + time * way;
    at = measured<kSegment>(mesh, feature_of(at), at_tip, d);
    Measured next;
    if (!beyond<kSegment>(mesh, at, at_tip, d, next)) {
      at = measured<kSegment>(mesh, feature_of(at), tip, d);
      return true;
    }
    if (!(next.depth < 0) && ++stalled > kStalledSteps) return false;
    at = next;
  }
  return false;
}

WalkResult separating(const Measured& at) {
  return {.feature = {},
          .separating_feature = feature_of(at),
          .normal = at.normal,
          .depth = at.depth,
          .probe_fraction = std::clamp(at.probe_fraction, 0.0, 1.0)};
}

template <bool kSegment>
WalkResult scanned(const CastMesh& part, const Vec3& tip, const Vec3& d) {
  ++part.full_scans;
  return kSegment ? nearest_feature_segment(part.mesh, tip, d)
                  : nearest_feature_point(part.mesh, tip);
}

template <bool kSegment>
WalkResult located(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d) {
  start = usable<kSegment>(part.mesh, start);
  if (start.kind != Kind::none) {
    WalkResult same = kSegment ? same_feature_segment(part.mesh, start, tip, d)
                               : same_feature_point(part.mesh, start, tip);
    if (same.depth < 0) return same;
    start = same.feature;
  }
  Measured outward;
  if (!outward_facet<kSegment>(part, start, tip, d, outward)) {
    WalkResult nearest = scanned<kSegment>(part, tip, d);
    if (nearest.feature.kind == Kind::none) return nearest;
    outward = measured<kSegment>(part.mesh, nearest.feature, tip, d);
  }
  if (outward.depth < 0) return separating(outward);
  // Inside: the facet on whose side it was holds it.
  WalkResult at =
      walked<kSegment>(part.mesh, start.kind != Kind::none ? start : feature_of(outward), tip, d);
  if (at.not_converged || at.capped) [[unlikely]]
    at = scanned<kSegment>(part, tip, d);
  return at;
}

template <bool kSegment>
PairCast cast(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
              const Vec3& motion) {
  const stimuli::ConvexMesh& mesh = part.mesh;
  const WalkResult from = located<kSegment>(part, start, tip, d);
  if (from.feature.kind != Kind::none) return {true, 0, from.feature};
  if (from.separating_feature.kind == Kind::none) return scan<kSegment>(part, tip, d, motion);
  double time = 0;
  Vec3 at_tip = tip;
  Measured at = measured<kSegment>(mesh, from.separating_feature, tip, d);
  if (part.trees.facet_map() != nullptr && glm::dot(at.normal, motion) < at.depth &&
      !is_near<kSegment>(mesh, at, tip, d)) {
    // A plane that has separated them for long may be far from where they are now.
    Measured under;
    if (outward_facet<kSegment>(part, {}, tip, d, under) && under.depth < 0) at = under;
  }
  const std::size_t most = mesh.facets().size() + mesh.edges().size();
  int stalled = 0;
  for (std::size_t step = 0; step < most + kStalledSteps; ++step) {
    const double height = -at.depth, rate = glm::dot(at.normal, motion);
    if (height + (1 - time) * rate >= 0) return {false, 1, feature_of(at)};
    if (height > 0 && rate < 0) {
      time = std::min(1.0, time + height / -rate);
      at_tip = tip + time * motion;
      stalled = 0;
      if (at.edge) at = measured<kSegment>(mesh, feature_of(at), at_tip, d);
    } else if (++stalled > kStalledSteps) {
      return scan<kSegment>(part, tip, d, motion);
    }
    Measured next;
    if (!beyond<kSegment>(mesh, at, at_tip, d, next)) return {true, time, feature_of(at)};
    // On the border of two facets rounding says of each that the line is past it.
    if (stalled > 1 && minkowski::distance_off<kSegment>(mesh, at, at_tip, d) <=
                           kOnBorder * (mesh.size() + glm::length(d)))
      return {true, time, feature_of(at)};
    at = next;
  }
  return scan<kSegment>(part, tip, d, motion);
}

}  // namespace

WalkResult locate(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d) {
  return is_point(part.mesh, d) ? located<false>(part, start, tip, Vec3(0))
                                : located<true>(part, start, tip, d);
}

PairCast cast(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
              const Vec3& motion) {
  return is_point(part.mesh, d) ? cast<false>(part, start, tip, Vec3(0), motion)
                                : cast<true>(part, start, tip, d, motion);
}

double distance_off(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                    const Vec3& d) {
  if (is_point(mesh, d))
    return minkowski::distance_off<false>(mesh, measured<false>(mesh, feature, tip, Vec3(0)), tip,
                                          Vec3(0));
  const Measured at = measured<true>(mesh, feature, tip, d);
  // Between the ends of both: the two meet, but for rounding.
  if (at.edge && at.within && !at.nearly_parallel) return 0;
  return minkowski::distance_off<true>(mesh, at, tip, d);
}

ContactFeature feature_beyond(const stimuli::ConvexMesh& mesh, ContactFeature feature,
                              const Vec3& tip, const Vec3& d) {
  Measured next;
  if (is_point(mesh, d)) {
    const Measured at = measured<false>(mesh, feature, tip, Vec3(0));
    const bool past = beyond<false>(mesh, at, tip + at.depth * at.normal, Vec3(0), next);
    return past ? feature_of(next) : ContactFeature();
  }
  const Measured at = measured<true>(mesh, feature, tip, d);
  const bool past = beyond<true>(mesh, at, tip + at.depth * at.normal, d, next);
  return past ? feature_of(next) : ContactFeature();
}

WalkResult measure(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                   const Vec3& d) {
  return is_point(mesh, d) ? same_feature_point(mesh, usable<false>(mesh, feature), tip)
                           : same_feature_segment(mesh, feature, tip, d);
}

}  // namespace palpate::rendering
