#pragma once
// The tick that both renderers share; they differ in what touches (a point or a segment) and in
// where along the probe a contact stands. Included by point_renderer.cpp and ray_renderer.cpp
// alone.

#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/force.h"
#include "rendering/renderer.h"

namespace palpate::tick {

inline bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

template <class Probe>
WalkResult walk(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip, const Vec3& d) {
  if constexpr (Probe::kSegment) return walk_segment(mesh, start, tip, d);
  return walk_point(mesh, start, tip);
}

template <class Probe>
WalkResult nearest_facet(const ConvexMesh& mesh, const Vec3& tip, const Vec3& d) {
  if constexpr (Probe::kSegment) return nearest_facet_segment(mesh, tip, d);
  return nearest_facet_point(mesh, tip);
}

/// The probe, translated by `shift` in the world, in the frame of the part's mesh.
template <class Probe>
LineProbe to_local(const ScenePart& part, const LineProbe& probe, const Vec3& shift) {
  const Vec3 tip = part.local_point(probe.tip + shift);
  return {tip, Probe::kSegment ? part.local_point(probe.tail + shift) : tip};
}

/// Contact of one part, found or followed. True when in contact. Frame of the part's mesh.
/// \param before  the probe at the last tick; null at the first tick of all
template <class Probe>
bool track(const ScenePart& part, PartState& state, const LineProbe* before, const LineProbe& probe,
           WalkResult& hit, std::uint32_t& faults) {
  using Kind = MinkowskiFacet::Kind;
  const ConvexMesh& mesh = *part.mesh;
  const Vec3 &tip = probe.tip, &tail = probe.tail;
  const Vec3 d = tail - tip;
  if (state.facet.kind != Kind::none) {
    hit = walk<Probe>(mesh, state.facet, tip, d);
    if (hit.capped) faults |= render_fault::kWalkCapped;
    state.facet = hit.facet;
    if (hit.facet.kind != Kind::none) return true;
    // The plane that the probe left by separates them from now on.
    state.plane = {hit.normal,
                   std::min(glm::dot(hit.normal, tip), glm::dot(hit.normal, tail)) + hit.depth,
                   true};
    return false;
  }
  if (state.plane.separates(tip, tail)) return false;  // the common case in free space
  find_separating_plane(mesh, tip, tail, part.tolerance, state.plane, state.support);
  if (state.blocked || !before) {
    state.blocked = !state.plane.valid &&
                    (state.blocked || nearest_facet<Probe>(mesh, tip, d).depth > part.tolerance);
    return false;
  }
  const LineProbe from = to_local<Probe>(part, *before, state.yielded);
  if (state.plane.separates(from.tip, from.tail)) return false;  // so was the whole way between
  const FirstContact first = Probe::first_contact(mesh, *part.trees, from, probe, part.tolerance);
  if (first.facet.kind != Kind::none) hit = walk<Probe>(mesh, first.facet, tip, d);
  if (hit.facet.kind == Kind::none) {
    if (state.plane.valid) return false;
    // Neither a plane nor a crossing: rounding hid the way in, so the nearest way out it is. Rare.
    hit = nearest_facet<Probe>(mesh, tip, d);
    if (hit.facet.kind == Kind::none || hit.depth <= part.tolerance) return false;
  }
  state.facet = hit.facet;
  state.plane.valid = false;
  return true;
}

/// One tick under way: the contacts found so far.
template <class Probe>
struct Tick {
  const Scene& scene;
  RenderState& state;
  const LineProbe& probe;
  double length;  ///< m, of the probe; 0 for a point
  double rate;    ///< 1/s, ticks; 0 when unknown
  std::uint32_t faults = 0;

  /// \param shift  m, world: what the part's siblings have already moved the ideal probe by
  void touch(std::uint32_t index, const Vec3& shift) {
    const ScenePart& part = scene.parts()[index];
    PartState& memory = state.parts[index];
    const LineProbe local = to_local<Probe>(part, probe, shift);
    WalkResult hit;
    const bool touching =
        track<Probe>(part, memory, state.has_last ? &state.last : nullptr, local, hit, faults);
    memory.yielded = shift;
    if (memory.blocked) faults |= render_fault::kStartedInside;
    if (!touching) return;
    if (state.contacts.size() == kMaxContacts) {
      faults |= render_fault::kContactsDropped;
      return;
    }
    LoadedContact& c = state.contacts.emplace_back();
    c.part = index;
    Probe::describe(*part.mesh, hit, local.tip, local.tail - local.tip, length, c);
    c.contact.normal = part.world_vector(hit.normal);
    c.contact.depth = hit.depth + glm::dot(c.contact.normal, shift);
    c.stiffness = part.material.stiffness;
    c.damping = part.material.damping;
    c.object = part.object;
    if (c.damping > 0 && rate > 0) {
      const double place = c.place;
      const Vec3 motion =
          (1 - place) * (probe.tip - state.last.tip) + place * (probe.tail - state.last.tail);
      c.closing_speed = -glm::dot(motion, c.contact.normal) * rate;
    }
  }

  /// What the other parts of the same compound move the ideal probe by.
  Vec3 shift_of_siblings(std::span<const std::uint32_t> group, std::uint32_t index) const {
    Vec3 shift(0);
    for (const std::uint32_t other : group) {
      if (other != index) shift += state.parts[other].share;
    }
    return shift;
  }

  /// Parts of one compound: each is met where the others let the ideal probe be, so that the probe
  /// slides over a seam instead of running into the inner wall behind it. Those that hold the probe
  /// come first: when one lets go, the next takes over in the same tick.
  void touch_compound(std::span<const std::uint32_t> group) {
    for (const bool held : {true, false}) {
      for (const std::uint32_t index : group) {
        PartState& memory = state.parts[index];
        if ((memory.facet.kind != MinkowskiFacet::Kind::none) != held) continue;
        touch(index, shift_of_siblings(group, index));
        if (memory.facet.kind == MinkowskiFacet::Kind::none) memory.share = Vec3(0);
      }
    }
  }
};

/// All parts in reach, their forces, and the sum.
template <class Probe>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe, double dt) {
  Rendering out;
  out.ideal = probe;
  if (!finite(probe.tip) || !finite(probe.tail)) {
    out.faults = render_fault::kNonFinite;
    out.ideal = state.last;
    return out;
  }
  survey(scene, state, probe);
  state.contacts.clear();
  Tick<Probe> tick{scene, state, probe, Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0,
                   state.has_last && dt > 0 ? 1 / dt : 0};
  const std::span<const std::uint32_t> near(state.near_parts);
  for (std::size_t begin = 0, end = 0; begin < near.size(); begin = end) {
    const int object = scene.parts()[near[begin]].object;
    for (end = begin + 1; end < near.size() && scene.parts()[near[end]].object == object;) ++end;
    if (end - begin == 1) {
      tick.touch(near[begin], state.parts[near[begin]].share = Vec3(0));
    } else {
      tick.touch_compound(near.subspan(begin, end - begin));
    }
  }
  state.last = probe;
  state.has_last = true;
  out.faults = tick.faults;
  if (state.contacts.empty()) return out;

  const std::span<LoadedContact> contacts(state.contacts);
  load(contacts);
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    // Where the ideal probe is: moved by all contacts with the same object.
    Vec3 shift(0);
    for (const auto& c : contacts) {
      if (c.object == contacts[i].object) shift += c.share * c.contact.normal;
    }
    Contact& contact = contacts[i].contact;
    state.parts[contacts[i].part].share = contacts[i].share * contact.normal;
    contact.along = contacts[i].place * tick.length;
    contact.point = probe.tip + contacts[i].place * (probe.tail - probe.tip) + shift;
    if (i == 0 || contact.depth > contacts[deepest].contact.depth) {
      deepest = i;
      out.ideal = {probe.tip + shift, probe.tail + shift};
    }
  }
  const Loads loads = sum_loads(contacts, probe);
  if (!finite(loads.force) || !finite(loads.torque)) {
    out.faults |= render_fault::kNonFinite;
    return out;
  }
  out.force = loads.force;
  if constexpr (Probe::kSegment) out.torque = loads.torque;
  out.device1 = loads.device1;
  out.device2 = loads.device2;
  out.contacts = static_cast<int>(contacts.size());
  out.object = contacts[deepest].object;
  out.deepest = contacts[deepest].contact;
  return out;
}

}  // namespace palpate::tick
