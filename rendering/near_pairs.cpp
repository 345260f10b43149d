#include "rendering/near_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "rendering/contact_detection.h"
#include "rendering/facet_walk.h"
#include "rendering/scene.h"
#include "rendering/separation.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

using namespace minkowski;

constexpr double kPoint = 1e-12;  // of the size; a shorter segment is a point
constexpr double kOnBorder =
    1e-11;                        // of the size; a segment that is no farther off is on the facet
constexpr int kStalledSteps = 8;  // without a later time: rounding; scan all facets

bool is_point(const stimuli::ConvexMesh& mesh, const Vec3& d) {
  const double least = kPoint * mesh.size();
  return glm::dot(d, d) <= least * least;
}

using Kind = ContactFeature::Kind;

/// A feature to start from. For a point, an edge is replaced by its left facet.
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
  const stimuli::SupportMap* const map = part.trees.support_map();
  return stimuli::support_vertex(part.mesh, along, map != nullptr ? map->near_support(along) : 0);
}

template <bool kSegment>
WalkResult walked(const stimuli::ConvexMesh& mesh, ContactFeature start, const Vec3& tip,
                  const Vec3& d) {
  if constexpr (kSegment) return walk_segment(mesh, start, tip, d);
  return walk_point(mesh, start, tip);
}

WalkResult separating(const Measured& at) {
  return {.feature = {},
          .separating_feature = feature_of(at),
          .normal = at.normal,
          .depth = at.depth,
          .probe_fraction = std::clamp(at.probe_fraction, 0.0, 1.0)};
}

/// Scans every facet of M, for lines whose steps rounding stops.
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

/// The facet of M adjacent to an edge where the segment is past one of its own ends or an end of
/// the edge. False if it is past neither, or if rounding hides the facet.
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

/// Whether the segment is past the facet of M by no more than a few facets' widths: then stepping
/// there is cheaper than a search.
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

/// The facet through which the line from the middle of M to the segment leaves M: its plane
/// separates the segment if any does. False if rounding hides it.
template <bool kSegment>
bool outward_facet(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
                   Measured& at) {
  const stimuli::ConvexMesh& mesh = part.mesh;
  const Vec3 middle = part.inside - 0.5 * d;
  const Vec3 way = tip - middle;
  at = facing<kSegment>(part, start, tip, d, way);
  double time = 1;  // of the line; falls from facet to facet
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
      // The line leaves M before the segment: this plane separates already.
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
  // Inside: walk from `start`, so the facet on whose side the segment was holds it.
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
    // A plane that has separated them for long may now be far away from them.
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
    // On the border of two facets, rounding may put the line past each of them.
    if (stalled > 1 && minkowski::distance_off<kSegment>(mesh, at, at_tip, d) <=
                           kOnBorder * (mesh.size() + glm::length(d)))
      return {true, time, feature_of(at)};
    at = next;
  }
  return scan<kSegment>(part, tip, d, motion);
}

/// m, of a segment above a plane, with the tool's tip at `tip`.
double height_above(const Vec3& normal, double offset, const Vec3& tip,
                    const PlacedSegment& segment) {
  return glm::dot(normal, tip + segment.from) - offset +
         std::min(0.0, glm::dot(normal, segment.along));
}

/// From a point to the nearest of a segment that starts at `to_start` from it.
Vec3 to_nearest(const Vec3& to_start, const Vec3& along, double per_length2) {
  return to_start - std::clamp(per_length2 * glm::dot(to_start, along), -1.0, 0.0) * along;
}

[[gnu::always_inline]] inline void prefetch(const stimuli::ConvexMesh& mesh,
                                            ContactFeature feature) {
  if (feature.kind == Kind::edge)
    __builtin_prefetch(&mesh.edges()[feature.index]);
  else
    __builtin_prefetch(&mesh.facets()[feature.index]);
}

double inverse_length2(const Vec3& along) {
  const double length2 = glm::dot(along, along);
  return length2 > 0 ? 1 / length2 : 0;
}

/// A segment whose distance to many points is computed.
struct Line {
  Line() = default;
  Line(const Vec3& start, const Vec3& d) : from(start), along(d) {
    const double length2 = glm::dot(d, d);
    per_length2 = length2 > 0 ? 1 / length2 : 0;
  }
  /// m^2, from p to the segment.
  double distance2(const Vec3& p) const {
    const Vec3 to = p - from;
    const double t = std::clamp(per_length2 * glm::dot(to, along), 0.0, 1.0);
    const Vec3 apart = to - t * along;
    return glm::dot(apart, apart);
  }

  Vec3 from, along;        // m
  double per_length2 = 0;  // 1/m^2
};

/// A part in contact stays: pressed through a thin plate, the virtual probe may be far from it.
bool in_contact(const RenderState& state, std::uint32_t part) {
  return state.parts[part].feature.kind != ContactFeature::Kind::none;
}

/// Lists a part if it is in reach; otherwise it bounds the clearance.
template <class Distance2>
void consider(const Scene& scene, RenderState& state, const Distance2& distance2, double step,
              std::uint32_t index) {
  const ScenePart& part = scene.parts()[index];
  const double gap = std::sqrt(distance2(part.sphere_centre)) - part.sphere_radius;
  if (in_reach(part, gap, step)) {
    state.near_parts.push_back(index);
  } else {
    state.clearance = std::min(state.clearance, gap);
  }
}

/// m, by which the part may approach before it counts as near.
double room_before(const ScenePart& part, double gap) {
  return gap - kReachShare * part.sphere_radius;
}

/// Lists the parts that may come near within `room`, m, and computes the room of the others. Skips
/// spheres all of whose parts have more than both.
template <class Distance2>
void search_tree(const Scene& scene, NearbyParts& nearby, const Distance2& distance2, double room) {
  struct Open {
    std::uint32_t node = 0;
    double distance2 = 0;  // m^2, from the middle of its sphere to the probe
  };
  const auto& nodes = scene.part_tree().nodes();
  const auto& order = scene.part_tree().order();
  const auto& spheres = scene.node_spheres();
  nearby.parts.clear();
  nearby.room = std::numeric_limits<double>::infinity();
  std::array<Open, 64> stack{};  // halves at each level: 2^32 parts need 32
  std::size_t count = 0;
  stack[count++] = {0, distance2(spheres[0].centre)};
  while (count > 0) {
    const Open at = stack[--count];
    // No part's sphere is larger than the one that holds it.
    const double far = std::max(room, nearby.room) + (1 + kReachShare) * spheres[at.node].radius;
    if (at.distance2 > far * far) continue;
    const stimuli::BoundingTree::Node& node = nodes[at.node];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const ScenePart& part = scene.parts()[order[i]];
      const double own =
          room_before(part, std::sqrt(distance2(part.sphere_centre)) - part.sphere_radius);
      if (own <= room)
        nearby.parts.push_back(order[i]);
      else
        nearby.room = std::min(nearby.room, own);
    }
    if (node.count > 0) continue;
    Open near{at.node + 1, distance2(spheres[at.node + 1].centre)};
    Open other{node.first, distance2(spheres[node.first].centre)};
    if (other.distance2 < near.distance2) std::swap(near, other);
    stack[count++] = other;
    stack[count++] = near;
  }
}

/// \param distance2  from a point to the probe, m^2
/// \param step       m, how far the probe may have moved past a part
/// \param moved      m, of any point of the probe at most, since the nearby parts were listed
/// \return whether the nearby parts were listed anew
template <class Distance2>
bool list_near_parts(const Scene& scene, RenderState& state, const Distance2& distance2,
                     double step, double moved) {
  state.clearance = std::numeric_limits<double>::infinity();
  if (scene.part_tree().nodes().empty()) {
    state.near_parts.clear();
    for (std::uint32_t i = 0; i < scene.parts().size(); ++i) {
      if (in_contact(state, i))
        state.near_parts.push_back(i);
      else
        consider(scene, state, distance2, step, i);
    }
    return false;
  }
  // After a jump, or in a dense scene, the list is long. Replace it as soon as a shorter one
  // suffices.
  const double mean = scene.mean_radius(), soon = kReachShare * mean;
  const bool leaps = step > soon;
  double others = state.nearby.room - moved;  // m, at least, of every part that is not nearby
  const bool anew = !(others > step);
  if (anew) {
    search_tree(scene, state.nearby, distance2, step + mean);
    others = state.nearby.room;
    if (state.nearby.parts.size() > Scene::kFewParts)
      state.nearby.room = std::min(others, leaps ? soon : 2 * mean);
  }
  std::erase_if(state.near_parts, [&](std::uint32_t i) { return !in_contact(state, i); });
  for (const std::uint32_t i : state.nearby.parts) {
    if (!in_contact(state, i)) consider(scene, state, distance2, step, i);
  }
  state.clearance = std::min(state.clearance, others);
  if (leaps || state.clearance == std::numeric_limits<double>::infinity())
    state.clearance = std::min(state.clearance, soon);
  std::sort(state.near_parts.begin(), state.near_parts.end());
  return anew;
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
  // Between the ends of both, the two meet within rounding.
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

template <class Visit>
void NearPairs::visit_near_parts(const Visit& visit) const {
  const auto& near = tick_.state.near_parts;
  const std::uint32_t end = group_.first_part + group_.part_count;
  for (auto i = std::lower_bound(near.begin(), near.end(), group_.first_part);
       i != near.end() && *i < end; ++i) {
    visit(*i);
  }
}

LineProbe NearPairs::shrunk(const NearPair& near, const Vec3& tip,
                            const PlacedSegment& segment) const {
  const ScenePart& part = part_of(near);
  const Vec3 from = part.local_point(tip + segment.from);
  const Vec3 start = part.inside + part.shrink * (from - part.inside);
  return {start, start + part.shrink * part.local_vector(segment.along)};
}

void NearPairs::collect(const ToolPose& from, const PlacedTool& placed_from, double motion,
                        double reach) {
  all_.near.clear();
  const PlacedTool& now = all_.now;
  std::array<double, Tool::kMostSegments> per_length2;
  for (std::uint32_t j = 0; j < now.count; ++j)
    per_length2[j] = inverse_length2(now.segments[j].along);
  const auto segments = static_cast<std::uint32_t>(tick_.scene.segments());
  visit_near_parts([&](std::uint32_t index) {
    const ScenePart& part = tick_.scene.parts()[index];
    if (part.breaking != ScenePart::kHolds && all_.breaking[part.breaking].strength == 0) return;
    const Vec3 to_tip = tick_.tool.tip - part.sphere_centre;
    const double margin = 2 * part.margin + part.tolerance;
    const double far = part.sphere_radius + std::max(motion, reach) + margin;
    const std::uint32_t first = group_.first_pair + (index - group_.first_part) * segments;
    for (std::uint32_t j = 0; j < now.count; ++j) {
      const PairState& state = all_.pairs[first + j];
      const PlacedSegment& segment = now.segments[j];
      Vec3 normal;
      double offset = 0;
      bool was_apart = false;
      if (!state.carries) {
        const Vec3 apart = to_nearest(to_tip + segment.from, segment.along, per_length2[j]);
        if (glm::dot(apart, apart) > far * far) continue;
        if (state.plane.valid) {
          normal = part.world_vector(state.plane.normal);
          offset = state.plane.offset + glm::dot(normal, part.position) + margin + part.tolerance;
          was_apart = height_above(normal, offset, from.tip, placed_from.segments[j]) > 0;
          if (was_apart && height_above(normal, offset, tick_.tool.tip, segment) > reach) continue;
        }
      }
      NearPair& near = all_.near.emplace_back();
      near.part = index;
      near.pair = first + j;
      near.segment = j;
      near.normal = normal;
      near.offset = offset;
      near.has_plane = !state.carries && state.plane.valid;
      near.was_apart = was_apart;
      near.came_with = state.feature;
      if (part.trees->facet_map() != nullptr) prefetch(*part.mesh, state.feature);
    }
  });
}

bool NearPairs::part_by_sphere(NearPair& near, const PosedSegment& from, const PosedSegment& to) {
  const ScenePart& part = part_of(near);
  const Vec3 apart = to_nearest(to.start - part.sphere_centre, to.along, inverse_length2(to.along));
  const double margin = 2 * (part.margin + part.tolerance);
  const double radius = part.sphere_radius + margin;
  const double distance2 = glm::dot(apart, apart);
  if (!(distance2 > radius * radius)) return false;
  const Vec3 normal = apart / std::sqrt(distance2);
  const double offset = glm::dot(normal, part.sphere_centre) + radius;
  const auto above = [&](const PosedSegment& segment) {
    return glm::dot(normal, segment.start) + std::min(0.0, glm::dot(normal, segment.along)) >
           offset;
  };
  if (!above(from) || !above(to)) return false;
  near.normal = normal;
  near.offset = offset;
  near.height = height_above(normal, offset, tick_.tool.tip, oriented_->segments[near.segment]);
  near.has_plane = true;
  state_of(near).plane = {part.local_vector(normal),
                          offset - margin - glm::dot(normal, part.position), true};
  return true;
}

void NearPairs::orient(const PlacedTool& oriented) {
  oriented_ = &oriented;
  for (NearPair& near : all_.near) {
    const ScenePart& part = part_of(near);
    const PlacedSegment& segment = oriented.segments[near.segment];
    near.true_tip = part.local_point(tick_.tool.tip + segment.from);
    near.true_d = part.local_vector(segment.along);
    near.tip = part.inside + part.shrink * (near.true_tip - part.inside);
    near.d = part.shrink * near.true_d;
    if (part.trees->facet_map() != nullptr && near.came_with.kind != Kind::none)
      prefetch_neighbours(*part.mesh, near.came_with);
    if (near.has_plane)
      near.height = height_above(near.normal, near.offset, tick_.tool.tip, segment);
  }
}

Entry NearPairs::sweep(NearPair& near, const LineProbe& before, const LineProbe& after) {
  PairState& state = state_of(near);
  const CastMesh mesh = mesh_of(near);
  const Vec3 d = before.tail - before.tip;
  const WalkResult start = locate(mesh, state.feature, before.tip, d);
  if (start.feature.kind != Kind::none) return {true, 0, start.feature};
  const bool point = glm::dot(d, d) == 0 && before.tail - before.tip == after.tail - after.tip;
  Approach approach;
  if (start.separating_feature.kind != Kind::none)
    approach = point ? approach_point(mesh.mesh, start.separating_feature, before, after)
                     : approach_segment(mesh.mesh, start.separating_feature, before, after);
  if (approach.end == Approach::End::separated) {
    state.feature = approach.feature;
    state.plane = approach.plane;
    return {};
  }
  if (approach.end == Approach::End::entered) return {true, approach.time, approach.feature};
  const double tolerance = part_of(near).tolerance;
  const FirstContact first =
      point ? first_contact_point(mesh.mesh, mesh.trees, before.tip, after.tip, tolerance)
            : first_contact_segment(mesh.mesh, mesh.trees, before, after, tolerance);
  if (first.feature.kind != Kind::none) return {true, first.time, first.feature};
  const WalkResult end = locate(mesh, start.separating_feature, after.tip, after.tail - after.tip);
  if (end.feature.kind != Kind::none) return {true, 1, end.feature};
  state.feature = end.separating_feature;
  return {};
}

bool NearPairs::virtual_inside() {
  collect(tick_.tool, all_.now, 0, 0);
  orient(all_.now);
  for (NearPair& near : all_.near) {
    PairState& state = state_of(near);
    const WalkResult at = locate(mesh_of(near), state.feature, near.true_tip, near.true_d);
    // A pair that carries the ideal tool keeps its facet, wherever the virtual tool is.
    if (!state.carries)
      state.feature = at.feature.kind != Kind::none ? at.feature : at.separating_feature;
    if (at.feature.kind != Kind::none && at.depth > part_of(near).tolerance) return true;
  }
  return false;
}

// Broad phase (scene.h): the parts that the probe can reach soon, by their bounding spheres.

void update_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe,
                       const ToolPose& tool, bool sides) {
  if (state.clearance == std::numeric_limits<double>::infinity()) return;
  UnionMemory& memory = state.unions;
  const Tool* const carried = sides ? scene.tool() : nullptr;
  // Bounds the tool's motion by that of its tip plus its size times the turn of its frame.
  const auto moved = [&](const ToolPose& a, const ToolPose& b) {
    double out = glm::length(a.tip - b.tip);
    if (carried == nullptr) return std::max(out, glm::length(a.tip + a.d - b.tip - b.d));
    double turned2 = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 apart = a.frame[k] - b.frame[k];
      turned2 += glm::dot(apart, apart);
    }
    return out + scene.tool_reach() * std::sqrt(turned2);
  };
  const double step = state.has_last ? moved(tool, memory.last) : 0;
  const double slack = memory.reach + step;
  if (state.clearance > 0 && moved(tool, memory.near_pose) + slack < state.clearance) return;
  state.near_parts_pose = probe;
  memory.near_pose = tool;
  const PlacedTool& placed = memory.now;
  std::array<Line, Tool::kMostSegments> lines;
  for (std::size_t j = 0; j < placed.count; ++j)
    lines[j] = {tool.tip + placed.segments[j].from, placed.segments[j].along};
  const auto distance2 = [&](const Vec3& p) {
    double least = HUGE_VAL;
    for (std::size_t j = 0; j < placed.count; ++j) least = std::min(least, lines[j].distance2(p));
    return least;
  };
  if (list_near_parts(scene, state, distance2, step + slack, moved(tool, memory.nearby_pose)))
    memory.nearby_pose = tool;
}

void rebuild_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe) {
  // The probe's motion in this tick: parts that it may have passed count as near.
  const double step = state.has_last ? std::max(glm::length(probe.tip - state.last.tip),
                                                glm::length(probe.tail - state.last.tail))
                                     : 0;
  state.near_parts_pose = probe;
  const Line line(probe.tip, probe.tail - probe.tip);
  const LineProbe& listed = state.nearby.pose;
  const double moved =
      std::max(glm::length(probe.tip - listed.tip), glm::length(probe.tail - listed.tail));
  const auto distance2 = [&](const Vec3& p) { return line.distance2(p); };
  if (list_near_parts(scene, state, distance2, step, moved)) state.nearby.pose = probe;
}

}  // namespace palpate::rendering
