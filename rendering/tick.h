#pragma once
// How one convex part is touched, found or followed, by either kind of probe.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/approach.h"
#include "rendering/force.h"
#include "rendering/renderer.h"

namespace palpate::rendering::tick {

// Farther off (m) than any device or hand: a reading beyond it is a fault, like NaN, and sums of
// squares below it are exact enough to separate objects.
constexpr double kFarthest = 1e6;

inline bool plausible(const Vec3& v) { return glm::dot(v, v) <= kFarthest * kFarthest; }

template <class Probe>
WalkResult walk(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip,
                const Vec3& d) {
  if constexpr (Probe::kSegment) return walk_segment(mesh, start, tip, d);
  return walk_point(mesh, start, tip);
}

template <class Probe>
WalkResult nearest_facet(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d) {
  if constexpr (Probe::kSegment) return nearest_facet_segment(mesh, tip, d);
  return nearest_facet_point(mesh, tip);
}

template <class Probe>
WalkResult same_facet(const stimuli::ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip,
                      const Vec3& d) {
  if constexpr (Probe::kSegment) return same_facet_segment(mesh, start, tip, d);
  return same_facet_point(mesh, start, tip);
}

/// The probe in the frame of the part's mesh.
template <class Probe>
[[gnu::always_inline]] inline LineProbe to_local(const ScenePart& part, const LineProbe& probe) {
  const Vec3 tip = part.local_point(probe.tip);
  return {tip, Probe::kSegment ? part.local_point(probe.tail) : tip};
}

/// The same, translated by `shift` in the world.
template <class Probe>
LineProbe to_local(const ScenePart& part, const LineProbe& probe, const Vec3& shift) {
  return to_local<Probe>(part, {probe.tip + shift, probe.tail + shift});
}

/// A facet of M near the probe to watch it from, outside of the object: the one of an earlier tick,
/// or one under the part of the probe that is nearest to the middle. Kind none: none is known.
template <class Probe>
MinkowskiFacet facet_near(const ScenePart& part, MinkowskiFacet known, const LineProbe& probe) {
  using Kind = MinkowskiFacet::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const SupportMap* const map = part.trees->support_map();
  if (map == nullptr) return known;
  const Vec3 d = probe.tail - probe.tip, to_tip = probe.tip - mesh.centre();
  const double d2 = glm::dot(d, d);
  const double place = d2 > 0 ? std::clamp(-glm::dot(to_tip, d) / d2, 0.0, 1.0) : 0;
  const std::uint32_t vertex = map->near_support(to_tip + place * d);
  const std::uint32_t edge = mesh.fan_edges()[mesh.fan_first()[vertex]];
  const MinkowskiFacet under(Kind::face, false, mesh.edges()[edge].left);
  if (known.kind == Kind::none) return under;
  return same_facet<Probe>(mesh, known, probe.tip, d).depth <=
                 same_facet<Probe>(mesh, under, probe.tip, d).depth
             ? known
             : under;
}

/// Where the probe has left the part: from now on the facet that it left by separates them.
inline void leave(PartState& state, const WalkResult& left, const LineProbe& probe) {
  const double lower =
      std::min(glm::dot(left.normal, probe.tip), glm::dot(left.normal, probe.tail));
  state.plane = {left.normal, lower + left.depth, true};
  state.watch = left.separates;
}

template <class Probe>
WalkResult holding_facet(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& d,
                         const Vec3& shift) {
  if constexpr (Probe::kSegment) return holding_facet_segment(mesh, tip, d, shift);
  return holding_facet_point(mesh, tip, shift);
}

/// A walk that was unsure, where no plane was found between object and probe: all facets are looked
/// at. False when the probe touches the surface at most; else `hit` becomes the facet that holds
/// it, of several the nearest to where the walk ended. Rare.
template <class Probe>
[[gnu::cold, gnu::noinline]] bool make_sure(const ScenePart& part, const Vec3& tip, const Vec3& d,
                                            WalkResult& hit) {
  const WalkResult nearest = nearest_facet<Probe>(*part.mesh, tip, d);
  if (nearest.facet.kind == MinkowskiFacet::Kind::none || nearest.depth <= part.tolerance) {
    return false;
  }
  const WalkResult holding = holding_facet<Probe>(*part.mesh, tip, d, hit.depth * hit.normal);
  hit = holding.facet.kind != MinkowskiFacet::Kind::none ? holding : nearest;
  return true;
}

/// Looks for a plane between the part and the probe, with no history; state.plane says whether
/// there is one.
inline void separate(const ScenePart& part, PartState& state, const LineProbe& probe) {
  const stimuli::ConvexMesh& mesh = *part.mesh;
  find_separating_plane(mesh, probe.tip, probe.tail, part.tolerance, state.plane, state.support,
                        part.trees->support_map());
  const std::uint32_t edge = mesh.fan_edges()[mesh.fan_first()[state.support]];
  state.watch = {MinkowskiFacet::Kind::face, false, mesh.edges()[edge].left};
}

/// A part that was not in contact at the last tick: its contact now, of kind none where there is
/// none. Frame of the part's mesh.
/// \param before  the probe at the last tick; null at the first tick of all
template <class Probe>
WalkResult meet(const ScenePart& part, PartState& state, const LineProbe* before,
                const LineProbe& probe) {
  using Kind = MinkowskiFacet::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const Vec3 d = probe.tail - probe.tip;
  LineProbe from = probe;
  FirstContact first;
  bool decided = false;
  if (before && !state.blocked) {
    from = to_local<Probe>(part, *before, state.yielded);
    const MinkowskiFacet near = facet_near<Probe>(part, state.watch, from);
    if (near.kind != Kind::none) {
      const WalkResult was = walk<Probe>(mesh, near, from.tip, from.tail - from.tip);
      if (was.facet.kind == Kind::none) {
        const Approach way = Probe::approach(mesh, was.separates, from, probe);
        if (way.end == Approach::End::separated) {
          state.plane = way.plane;
          state.watch = way.facet;
          return {};
        }
        decided = way.end == Approach::End::entered;
        if (decided) first = {way.facet, way.time};
      }
    }
  }
  if (!decided) {
    separate(part, state, probe);
    if (state.blocked || !before) {
      state.blocked =
          !state.plane.valid &&
          (state.blocked || nearest_facet<Probe>(mesh, probe.tip, d).depth > part.tolerance);
      return {};
    }
    if (state.plane.separates(from.tip, from.tail)) return {};  // so was the whole way between
    first = Probe::first_contact(mesh, *part.trees, from, probe, part.tolerance);
  }
  WalkResult hit;
  if (first.facet.kind != Kind::none) hit = walk<Probe>(mesh, first.facet, probe.tip, d);
  if (hit.unsure) [[unlikely]] {
    if (decided) separate(part, state, probe);
    if (state.plane.valid || !make_sure<Probe>(part, probe.tip, d, hit)) return {};
  }
  if (hit.facet.kind == Kind::none) {
    if (decided) {  // in and out again
      leave(state, hit, probe);
      return {};
    }
    if (state.plane.valid) return {};
    // Neither a plane nor a crossing: rounding hid the way in, so the nearest way out it is. Rare.
    hit = nearest_facet<Probe>(mesh, probe.tip, d);
    if (hit.facet.kind == Kind::none || hit.depth <= part.tolerance) return {};
  }
  state.facet = hit.facet;
  state.plane.valid = false;
  fetch_ahead(mesh, state.facet);
  return hit;
}

/// Contact of one part, found or followed; of kind none where there is none. Frame of the part's
/// mesh.
/// \param before  the probe at the last tick; null at the first tick of all
/// \param d       tail - tip of the probe, m
template <class Probe>
[[gnu::always_inline]] inline WalkResult track(const ScenePart& part, PartState& state,
                                               const LineProbe* before, const Vec3& tip,
                                               const Vec3& d, std::uint32_t& faults) {
  using Kind = MinkowskiFacet::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const bool held = state.facet.kind != Kind::none;
  // In free space the plane of an earlier tick mostly still stands between them. Written so that
  // the result is built in place: a copy of it costs as much as a dot product or five.
  WalkResult hit = held ? walk<Probe>(mesh, state.facet, tip, d)
                   : state.plane.separates(tip, tip + d)
                       ? WalkResult()
                       : meet<Probe>(part, state, before, {tip, tip + d});
  if (!held) return hit;
  if (hit.capped) faults |= render_fault::kWalkCapped;
  if (hit.unsure) [[unlikely]] {
    separate(part, state, {tip, tip + d});
    if (state.plane.valid || !make_sure<Probe>(part, tip, d, hit)) {
      state.facet = hit.facet = {};
      return hit;
    }
  }
  const bool moved = !(hit.facet == state.facet);
  state.facet = hit.facet;
  if (hit.facet.kind == Kind::none) {
    leave(state, hit, {tip, tip + d});
  } else if (moved) {
    fetch_ahead(mesh, state.facet);
  }
  return hit;
}

/// One tick under way: the contacts found so far.
template <class Probe>
struct Tick {
  const Scene& scene;
  RenderState& state;
  const LineProbe& probe;
  double length;  ///< m, of the probe; 0 for a point
  std::uint32_t faults = 0;

  const LineProbe* last() const { return state.has_last ? &state.last : nullptr; }

  /// Follows one part. True when it is in contact; then that is filled in.
  /// \tparam kShares  whether siblings of the part move the ideal probe by `shift` (m, world)
  template <bool kShares>
  [[gnu::always_inline]] bool contact(std::uint32_t index, const Vec3& shift, LoadedContact& c) {
    const ScenePart& part = scene.parts()[index];
    PartState& memory = state.parts[index];
    const Vec3 tip = part.local_point(kShares ? probe.tip + shift : probe.tip);
    const Vec3 d = Probe::kSegment ? part.local_vector(probe.tail - probe.tip) : Vec3(0);
    const WalkResult hit = track<Probe>(part, memory, last(), tip, d, faults);
    if constexpr (kShares) memory.yielded = shift;
    if (memory.blocked) faults |= render_fault::kStartedInside;
    if (hit.facet.kind == MinkowskiFacet::Kind::none) return false;
    c.part = index;
    Probe::describe(*part.mesh, hit, tip, d, length, c);
    c.contact.normal = part.world_vector(hit.normal);
    c.contact.depth = hit.depth;
    if constexpr (kShares) c.contact.depth += glm::dot(c.contact.normal, shift);
    c.stiffness = part.material.stiffness;
    c.object = part.object;
    return true;
  }

  /// Where a loaded contact stands: on the ideal probe.
  /// \param shift  m, of the ideal probe, without its lag by friction. \return with it
  template <bool kFriction>
  Vec3 place(LoadedContact& c, Vec3 shift) const {
    if constexpr (kFriction) shift += c.lag;
    c.contact.point = probe.tip + shift;
    if constexpr (Probe::kSegment) {
      c.contact.along = c.place * length;
      c.contact.point += c.place * (probe.tail - probe.tip);
    }
    c.shift = shift;
    return shift;
  }

  /// Follows one part and adds its contact, if there is one, to the tick's.
  template <bool kShares>
  void touch(std::uint32_t index, const Vec3& shift) {
    LoadedContact found;
    // There is room for a contact of every part (Scene::initial_state): nothing is allocated.
    if (contact<kShares>(index, shift, found)) state.contacts.push_back(found);
  }
};

}  // namespace palpate::rendering::tick
