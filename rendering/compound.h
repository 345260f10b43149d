#pragma once
// Several convex parts of one object in contact at once. Included by tick.h alone.

#include <algorithm>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/contact_detection.h"
#include "rendering/render_fault.h"

namespace palpate::rendering::tick {

/// One object of several convex parts has one ideal probe. Each part is tracked at the position
/// where its siblings, the other parts of the object, let the ideal probe be, so that the probe
/// slides over a seam instead of running into the inner wall behind it. World frame.
template <class Tick>
struct Compound {
  using Probe = typename Tick::Probe;
  using Kind = ContactFeature::Kind;

  Tick& tick;
  std::span<const std::uint32_t> group;  ///< indices of the object's parts that are near

  const ScenePart& part(std::uint32_t index) const { return tick.scene.parts()[index]; }
  PartState& memory(std::uint32_t index) const { return tick.state.parts[index]; }
  bool in_contact(std::uint32_t index) const { return memory(index).feature.kind != Kind::none; }

  LineProbe local_probe(std::uint32_t index, const Vec3& correction) const {
    return Probe::to_local(part(index), translated(tick.probe, correction));
  }

  /// Contact of one part where its siblings let the ideal probe be. Sets what the part adds to the
  /// ideal probe's displacement.
  /// \param before  the probe that the part's sibling_correction belongs to; null at the first tick
  /// of all
  bool track(std::uint32_t index, const Vec3& correction, const LineProbe* before) {
    PartState& state = memory(index);
    const WalkResult hit = tick.track_part(index, before, local_probe(index, correction));
    const bool touching = hit.feature.kind != Kind::none;
    state.sibling_correction = correction;
    state.displacement = touching ? hit.depth * part(index).world_vector(hit.normal) : Vec3(0);
    return touching;
  }

  /// m; what the siblings displace the ideal probe by, and a hair more: where two parts abut, the
  /// ideal probe lies on a side of both facets, and rounding must not push it over.
  Vec3 correction_by_siblings(std::uint32_t index) const {
    Vec3 correction(0);
    for (const std::uint32_t other : group) {
      if (other == index || !in_contact(other)) continue;
      const Vec3& displacement = memory(other).displacement;
      const double size = glm::length(displacement);
      if (size > 0) correction += (1 + 4 * part(other).tolerance / size) * displacement;
    }
    return correction;
  }

  /// Displacements of the parts in contact, each still on the feature of the last tick.
  void update_displacements() {
    for (const std::uint32_t index : group) {
      if (!in_contact(index)) continue;
      PartState& state = memory(index);
      const LineProbe local = local_probe(index, correction_by_siblings(index));
      const WalkResult on =
          Probe::same_feature(*part(index).mesh, state.feature, local.tip, local.tail - local.tip);
      state.displacement = std::max(0.0, on.depth) * part(index).world_vector(on.normal);
    }
  }

  /// The parts in contact walk to where the probe is. Those that seem to let go keep their feature
  /// and lose their displacement: a sibling's may be about to change.
  void walk_parts() {
    for (const std::uint32_t index : group) {
      if (!in_contact(index)) continue;
      PartState& state = memory(index);
      const PartState kept = state;
      if (!track(index, correction_by_siblings(index), tick.last())) {
        state = kept;
        state.displacement = Vec3(0);
      }
    }
  }

  /// Of a part that is not in contact: the feature by which the probe enters between `before` and
  /// now. Changes nothing but the part's separating plane.
  FirstContact entry(std::uint32_t index, const Vec3& correction, const LineProbe& before) {
    const stimuli::ConvexMesh& mesh = *part(index).mesh;
    const double tolerance = part(index).tolerance;
    PartState& state = memory(index);
    const LineProbe local = local_probe(index, correction);
    if (state.plane.separates(local.tip, local.tail)) return {};
    find_separating_plane(mesh, local.tip, local.tail, tolerance, state.plane, state.support);
    const LineProbe from =
        Probe::to_local(part(index), translated(before, state.sibling_correction));
    if (state.plane.separates(from.tip, from.tail)) return {};
    const FirstContact first =
        Probe::first_contact(mesh, *part(index).trees, from, local, tolerance);
    if (first.feature.kind != Kind::none || state.plane.valid) return first;
    // Rounding hid the entry: the least penetration depth decides.
    const WalkResult nearest = Probe::nearest_feature(mesh, local.tip, local.tail - local.tip);
    if (nearest.feature.kind == Kind::none || nearest.depth <= tolerance) return first;
    return {nearest.feature, 1};
  }

  /// The earliest entry into a part that is not in contact, of kind none where there is none.
  FirstContact earliest_entry(const LineProbe& before, std::uint32_t& entered) {
    FirstContact earliest;
    for (const std::uint32_t index : group) {
      if (in_contact(index) || memory(index).started_inside) continue;
      const FirstContact first = entry(index, correction_by_siblings(index), before);
      if (first.feature.kind != Kind::none && first.time < earliest.time) {
        earliest = first;
        entered = index;
      }
    }
    return earliest;
  }

  /// Parts that are not in contact are entered one by one, the earliest first: each changes where
  /// the ideal probe of the others may be. True when one is.
  bool enter_parts(const LineProbe* before) {
    bool any = false;
    if (before) {
      for (std::size_t round = 0; round < group.size(); ++round) {
        std::uint32_t entered = 0;
        const FirstContact earliest = earliest_entry(*before, entered);
        if (earliest.feature.kind == Kind::none) break;
        memory(entered).feature = earliest.feature;
        memory(entered).plane.valid = false;
        update_displacements();
        update_displacements();
        any = true;
      }
    }
    for (const std::uint32_t index : group) {
      PartState& state = memory(index);
      if (in_contact(index)) continue;
      const Vec3 correction = correction_by_siblings(index);
      if (!before || state.started_inside) track(index, correction, before);
      state.sibling_correction = correction;
    }
    return any;
  }

  /// Adds the object's contacts to the tick's. The ideal probe moves in two strokes, first on the
  /// features of the last tick, then to those that it belongs on now: when a part lets go or is
  /// left over an edge, the part that the probe has slid onto takes it up.
  void add_contacts() {
    update_displacements();
    update_displacements();
    enter_parts(tick.last());
    walk_parts();
    walk_parts();
    for (int round = 0; round < 4 && enter_parts(&tick.probe); ++round) {
      walk_parts();
      walk_parts();
    }
    // Reporting walks once more, where all displacements are known. A part that lets go only now
    // gives the others another chance to be entered.
    const std::size_t reported = tick.state.contacts.size();
    for (int round = 0; round < 4; ++round) {
      tick.state.contacts.resize(reported);
      bool let_go = false;
      for (const std::uint32_t index : group) {
        if (!in_contact(index)) continue;
        tick.template add_contact_of<true>(index, correction_by_siblings(index));
        let_go |= !in_contact(index);
      }
      if (!let_go || !enter_parts(&tick.probe)) break;
    }
    for (const std::uint32_t index : group) {
      if (memory(index).started_inside) tick.faults |= render_fault::kStartedInside;
    }
  }
};

}  // namespace palpate::rendering::tick
