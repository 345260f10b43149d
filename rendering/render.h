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
template <class Probe>
void feel(const Tick<Probe>& tick, std::span<LoadedContact> contacts, double rate) {
  const auto& parts = tick.scene.parts();
  RenderState& state = tick.state;
  const auto sibling_grip = [&](const LoadedContact& c) {
    for (const std::uint32_t i : state.near_parts) {
      if (parts[i].object == c.object && state.parts[i].grip.held) return state.parts[i].grip;
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
    const Material& material = parts[c.part].material;
    const LineProbe& last = state.has_last ? state.last : tick.probe;
    const Vec3 motion =
        (1 - c.place) * (tick.probe.tip - last.tip) + c.place * (tick.probe.tail - last.tail);
    if (!material.layers.empty()) c.force = layered_force(material, c.share);
    if (material.damping > 0 && c.share > 0) {
      const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
      c.force = std::max(0.0, c.force + material.damping * closing_speed);
    }
    if (material.has_friction()) rub(c, material, motion, state.parts[c.part].grip);
  }
}

/// Where the ideal probe is, and the sum of all forces.
/// \tparam kCount  how many contacts, where that is known beforehand: then no loop remains
template <class Probe, bool kPlainSprings, std::size_t kCount>
Rendering add_up(const Tick<Probe>& tick, std::span<LoadedContact, kCount> contacts) {
  const LineProbe& probe = tick.probe;
  const Vec3 d = probe.tail - probe.tip;
  std::size_t deepest = 0;
  Vec3 deepest_shift(0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    // Where the ideal probe is: moved by all contacts with the same object.
    Vec3 shift(0);
    for (const auto& c : contacts) {
      if (c.object == contacts[i].object) shift += c.share * c.contact.normal;
    }
    Contact& contact = contacts[i].contact;
    if constexpr (kCount != 1)
      tick.state.parts[contacts[i].part].share = contacts[i].share * contact.normal;
    contact.along = contacts[i].place * tick.length;
    contact.point = probe.tip + contacts[i].place * d + shift;
    if constexpr (!kPlainSprings) {
      shift += contacts[i].lag;
      contact.point += contacts[i].lag;
    }
    if (i == 0 || contact.depth > contacts[deepest].contact.depth) {
      deepest = i;
      deepest_shift = shift;
    }
  }
  const Loads loads = sum_loads<kPlainSprings>(contacts, probe);
  const Vec3 all = loads.force + loads.torque;
  if (!std::isfinite(all.x + all.y + all.z)) {
    Rendering none;
    none.ideal = probe;
    none.faults = tick.faults | render_fault::kNonFinite;
    return none;
  }
  return {.force = loads.force,
          .torque = Probe::kSegment ? loads.torque : Vec3(0),
          .device1 = loads.device1,
          .device2 = loads.device2,
          .deepest = contacts[deepest].contact,
          .ideal = {probe.tip + deepest_shift, probe.tail + deepest_shift},
          .contacts = static_cast<int>(contacts.size()),
          .object = contacts[deepest].object,
          .faults = tick.faults};
}

/// All parts in reach: their contacts into state.contacts.
template <class Probe>
void touch_parts(Tick<Probe>& tick) {
  survey(tick.scene, tick.state, tick.probe);
  tick.state.contacts.clear();
  const std::span<const std::uint32_t> near(tick.state.near_parts);
  for (std::size_t begin = 0, end = 0; begin < near.size(); begin = end) {
    const int object = tick.scene.parts()[near[begin]].object;
    for (end = begin + 1; end < near.size() && tick.scene.parts()[near[end]].object == object;)
      ++end;
    if (end - begin == 1) {
      tick.touch(near[begin], Vec3(0));
    } else {
      Compound<Probe>{tick, near.subspan(begin, end - begin)}.touch();
    }
  }
}

/// \tparam kPlainSprings  no material of the scene asks for more
/// \tparam kOnePart  the scene is one convex part: no survey, no sums, no list of contacts
template <class Probe, bool kPlainSprings, bool kOnePart>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe, double dt) {
  Rendering none;
  if (!plausible(probe.tip) || !plausible(probe.tail)) {
    none.ideal = state.last;
    none.faults = render_fault::kNonFinite;
    return none;
  }
  Tick<Probe> tick{scene, state, probe, Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0};
  const auto feel_all = [&](auto contacts) {
    load(contacts);
    if constexpr (!kPlainSprings) feel(tick, contacts, dt > 0 ? 1 / dt : 0);
    state.last = probe;
    state.has_last = true;
  };
  if constexpr (kOnePart) {
    LoadedContact contact;
    const bool touching = tick.contact(0, Vec3(0), contact);
    const std::span<LoadedContact, 1> contacts(&contact, 1);
    if (touching) {
      feel_all(contacts);
      return add_up<Probe, kPlainSprings>(tick, contacts);
    }
    feel_all(std::span<LoadedContact, 0>());
  } else {
    touch_parts(tick);
    const std::span<LoadedContact> contacts(state.contacts);
    feel_all(contacts);
    if (!contacts.empty()) return add_up<Probe, kPlainSprings>(tick, contacts);
  }
  none.ideal = probe;
  none.faults = tick.faults;
  return none;
}

/// The least tick that shows the scene.
template <class Probe>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe, double dt) {
  if (scene.parts().size() == 1) {
    return scene.plain_springs() ? render<Probe, true, true>(scene, state, probe, dt)
                                 : render<Probe, false, true>(scene, state, probe, dt);
  }
  return scene.plain_springs() ? render<Probe, true, false>(scene, state, probe, dt)
                               : render<Probe, false, false>(scene, state, probe, dt);
}

}  // namespace palpate::tick
