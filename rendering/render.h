#pragma once
// The tick that both renderers share; they differ in what touches (a point or a segment) and in
// where along the probe a contact stands. Included by point_renderer.cpp and ray_renderer.cpp
// alone.

#include <glm/geometric.hpp>
#include <span>

#include "rendering/compound.h"
#include "rendering/tick.h"

namespace palpate::tick {

/// What materials add to plain springs: layers, damping, friction.
/// \param rate  1/s, ticks; 0 when unknown
inline void feel(const Scene& scene, RenderState& state, const LineProbe& probe, double rate) {
  const std::span<LoadedContact> contacts(state.contacts);
  const auto sibling_grip = [&](const LoadedContact& c) {
    for (const std::uint32_t i : state.near_parts) {
      if (scene.parts()[i].object == c.object && state.parts[i].grip.held)
        return state.parts[i].grip;
    }
    return Grip{};
  };
  // A part that takes over from its sibling at a seam takes over the lag as well.
  for (const auto& c : contacts) {
    Grip& grip = state.parts[c.part].grip;
    if (!grip.held) grip = sibling_grip(c);
  }
  for (const std::uint32_t i : state.near_parts) state.parts[i].grip.held = false;
  for (auto& c : contacts) {
    const Material& material = scene.parts()[c.part].material;
    const Vec3 motion = state.has_last ? (1 - c.place) * (probe.tip - state.last.tip) +
                                             c.place * (probe.tail - state.last.tail)
                                       : Vec3(0);
    if (!material.layers.empty()) c.force = layered_force(material, c.share);
    if (material.damping > 0 && c.share > 0) {
      const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
      c.force = std::max(0.0, c.force + material.damping * closing_speed);
    }
    if (material.has_friction()) rub(c, material, motion, state.parts[c.part].grip);
  }
}

/// All parts in reach, their forces, and the sum.
/// \tparam kPlainSprings  no material of the scene asks for more
template <class Probe, bool kPlainSprings>
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
  Tick<Probe> tick{scene, state, probe, Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0};
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
  const std::span<LoadedContact> contacts(state.contacts);
  load(contacts);
  if constexpr (!kPlainSprings) feel(scene, state, probe, dt > 0 ? 1 / dt : 0);
  state.last = probe;
  state.has_last = true;
  out.faults = tick.faults;
  if (contacts.empty()) return out;

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
    if constexpr (!kPlainSprings) {
      shift += contacts[i].lag;
      contact.point += contacts[i].lag;
    }
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
