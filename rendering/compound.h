#pragma once
// Several convex parts of one object touched at once. Included by render.h alone.

#include <algorithm>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/tick.h"

namespace palpate::rendering::tick {

/// Each part is met where the others let the ideal probe be, so that the probe slides over a seam
/// instead of running into the inner wall behind it.
template <class Probe>
struct Compound {
  Tick<Probe>& tick;
  std::span<const std::uint32_t> group;  ///< parts of the scene, in reach

  /// Contact of one part where its siblings let the ideal probe be. Sets the part's share to what
  /// it adds to their shift.
  /// \param before  the probe that part.yielded belongs to; null at the first tick of all
  bool follow(std::uint32_t index, const Vec3& shift, const LineProbe* before) {
    const ScenePart& part = tick.scene.parts()[index];
    PartState& memory = tick.state.parts[index];
    const LineProbe local = to_local<Probe>(part, tick.probe, shift);
    const WalkResult hit =
        track<Probe>(part, memory, before, local.tip, local.tail - local.tip, tick.faults);
    const bool touching = hit.facet.kind != MinkowskiFacet::Kind::none;
    memory.yielded = shift;
    memory.share = touching ? hit.depth * part.world_vector(hit.normal) : Vec3(0);
    return touching;
  }

  bool holds(std::uint32_t index) const {
    return tick.state.parts[index].facet.kind != MinkowskiFacet::Kind::none;
  }

  /// What the other parts of the same compound move the ideal probe by, and a hair more: where two
  /// parts abut, the ideal probe lies on a side of both facets, and rounding must not push it over.
  Vec3 shift_of_siblings(std::uint32_t index) const {
    Vec3 shift(0);
    for (const std::uint32_t other : group) {
      if (other == index || !holds(other)) continue;
      const Vec3& share = tick.state.parts[other].share;
      const double size = glm::length(share);
      if (size > 0) shift += (1 + 4 * tick.scene.parts()[other].tolerance / size) * share;
    }
    return shift;
  }

  /// The parts that hold the probe, each still on the facet of the last tick.
  void slide() {
    for (const std::uint32_t index : group) {
      if (!holds(index)) continue;
      const ScenePart& part = tick.scene.parts()[index];
      PartState& memory = tick.state.parts[index];
      const LineProbe local = to_local<Probe>(part, tick.probe, shift_of_siblings(index));
      const WalkResult on =
          same_facet<Probe>(*part.mesh, memory.facet, local.tip, local.tail - local.tip);
      memory.share = std::max(0.0, on.depth) * part.world_vector(on.normal);
    }
  }

  /// The parts that hold the probe walk to where it is. Those that seem to let go keep their facet
  /// and lose their share: a sibling's share may be about to change.
  void settle() {
    for (const std::uint32_t index : group) {
      if (!holds(index)) continue;
      PartState& memory = tick.state.parts[index];
      const PartState kept = memory;
      if (!follow(index, shift_of_siblings(index), tick.last())) {
        memory = kept;
        memory.share = Vec3(0);
      }
    }
  }

  /// A part that does not hold the probe yet: the facet by which it comes in between `before` and
  /// now. Only looks.
  FirstContact entry(std::uint32_t index, const Vec3& shift, const LineProbe& before) {
    const ScenePart& part = tick.scene.parts()[index];
    PartState& memory = tick.state.parts[index];
    const LineProbe local = to_local<Probe>(part, tick.probe, shift);
    if (memory.plane.separates(local.tip, local.tail)) return {};
    find_separating_plane(*part.mesh, local.tip, local.tail, part.tolerance, memory.plane,
                          memory.support);
    const LineProbe from = to_local<Probe>(part, before, memory.yielded);
    if (memory.plane.separates(from.tip, from.tail)) return {};
    FirstContact first = Probe::first_contact(*part.mesh, *part.trees, from, local, part.tolerance);
    if (first.facet.kind != MinkowskiFacet::Kind::none || memory.plane.valid) return first;
    const WalkResult nearest = nearest_facet<Probe>(*part.mesh, local.tip, local.tail - local.tip);
    if (nearest.facet.kind != MinkowskiFacet::Kind::none && nearest.depth > part.tolerance)
      first = {nearest.facet, 1};
    return first;
  }

  /// The parts that do not hold the probe are met on the way to where the others let it be, the
  /// earliest first: it changes where the others let it be. True when one is met.
  bool meet(const LineProbe* before) {
    bool met = false;
    if (before) {
      for (std::size_t round = 0; round < group.size(); ++round) {
        FirstContact earliest;
        std::uint32_t at = 0;
        for (const std::uint32_t index : group) {
          if (holds(index) || tick.state.parts[index].blocked) continue;
          const FirstContact first = entry(index, shift_of_siblings(index), *before);
          if (first.facet.kind != MinkowskiFacet::Kind::none && first.time < earliest.time) {
            earliest = first;
            at = index;
          }
        }
        if (earliest.facet.kind == MinkowskiFacet::Kind::none) break;
        tick.state.parts[at].facet = earliest.facet;
        tick.state.parts[at].plane.valid = false;
        slide();
        slide();
        met = true;
      }
    }
    for (const std::uint32_t index : group) {
      PartState& memory = tick.state.parts[index];
      if (holds(index)) continue;
      const Vec3 shift = shift_of_siblings(index);
      if (!before || memory.blocked) follow(index, shift, before);
      memory.yielded = shift;
    }
    return met;
  }

  /// Parts of one compound: each is met where the others let the ideal probe be, so that the probe
  /// slides over a seam instead of running into the inner wall behind it. The ideal probe moves in
  /// two strokes, first on the facets of the last tick, then to those that it belongs on now: when
  /// a part lets go or is left over an edge, what the probe has slid over takes it up.
  void touch() {
    slide();
    slide();
    meet(tick.last());
    settle();
    settle();
    for (int round = 0; round < 4 && meet(&tick.probe); ++round) {
      settle();
      settle();
    }
    // Reporting walks once more, where all shares are known. A part that lets go only now gives the
    // others another chance to be met.
    const std::size_t reported = tick.state.contacts.size();
    for (int round = 0; round < 4; ++round) {
      tick.state.contacts.resize(reported);
      bool let_go = false;
      for (const std::uint32_t index : group) {
        if (!holds(index)) continue;
        tick.template touch<true>(index, shift_of_siblings(index));
        let_go |= !holds(index);
      }
      if (!let_go || !meet(&tick.probe)) break;
    }
    for (const std::uint32_t index : group) {
      if (tick.state.parts[index].blocked) tick.faults |= render_fault::kStartedInside;
    }
  }
};

}  // namespace palpate::rendering::tick
