#pragma once
// The tick that both renderers share; they differ in what touches (a point or a segment) and in
// where along the probe a contact stands. Included by point_renderer.cpp and ray_renderer.cpp
// alone.

#include <glm/geometric.hpp>
#include <span>

#include "rendering/compound.h"
#include "rendering/tick.h"

namespace palpate::tick {

/// All parts in reach, their forces, and the sum.
template <class Probe>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe, double dt) {
  Rendering out;
  out.ideal = probe;
  if (!plausible(probe.tip) || !plausible(probe.tail)) {
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
      tick.touch(near[begin], Vec3(0));
    } else {
      Compound<Probe>{tick, near.subspan(begin, end - begin)}.touch();
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
