#pragma once
// The tick that both renderers share; they differ in what touches (a point or a segment) and in
// where along the probe a contact stands (point_probe.h, segment_probe.h). Included by what
// instantiates ticks.

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "rendering/compound.h"
#include "rendering/tick.h"

namespace palpate::rendering::tick {

/// What materials add to plain springs: layers, damping, friction.
/// \param rate  1/s, ticks; 0 when unknown
template <Needs kNeeds>
void feel(const Scene& scene, RenderState& state, const LineProbe& probe,
          std::span<LoadedContact> contacts, double rate) {
  const auto& parts = scene.parts();
  if constexpr (kNeeds.friction) {
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
  }
  for (auto& c : contacts) {
    const stimuli::Material& material = parts[c.part].material;
    if constexpr (kNeeds.layers) {
      if (!material.layers.empty()) c.force = layered_force(material, c.share);
    }
    if constexpr (kNeeds.damping || kNeeds.friction) {
      const LineProbe& last = state.has_last ? state.last : probe;
      const Vec3 motion =
          (1 - c.place) * (probe.tip - last.tip) + c.place * (probe.tail - last.tail);
      if (kNeeds.damping && material.damping > 0 && c.share > 0) {
        const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
        c.force = std::max(0.0, c.force + material.damping * closing_speed);
      }
      if (kNeeds.friction && material.has_friction())
        rub(c, material, motion, state.parts[c.part].grip);
    }
  }
}

/// No contact.
inline Rendering nothing(const LineProbe& ideal, std::uint32_t faults) {
  Rendering none;
  none.ideal = ideal;
  none.faults = faults;
  return none;
}

/// What goes out, unless it is not finite.
/// \param shift  m, of the ideal probe, by what moves it at the deepest contact
template <class Probe>
[[gnu::always_inline]] inline Rendering give(const Tick<Probe>& tick, const Loads& loads,
                                             const LoadedContact& deepest, const Vec3& shift,
                                             std::size_t contacts) {
  const Vec3 all = loads.force + loads.torque;
  if (!std::isfinite(all.x + all.y + all.z))
    return nothing(tick.probe, tick.faults | render_fault::kNonFinite);
  return {.force = loads.force,
          .torque = loads.torque,
          .device1 = loads.device1,
          .device2 = loads.device2,
          .deepest = deepest.contact,
          .ideal = {tick.probe.tip + shift, tick.probe.tail + shift},
          .contacts = static_cast<int>(contacts),
          .object = deepest.object,
          .faults = tick.faults};
}

/// Where the ideal probe is, and the sum of all forces.
template <class Probe, bool kFriction>
Rendering add_up(const Tick<Probe>& tick, std::span<LoadedContact> contacts) {
  std::size_t deepest = 0;
  Vec3 deepest_shift(0), object_shift(0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    // Where the ideal probe is: moved by all contacts with the same object, which stand side by
    // side.
    const int object = contacts[i].object;
    if (i == 0 || object != contacts[i - 1].object) {
      object_shift = Vec3(0);
      for (std::size_t k = i; k < contacts.size() && contacts[k].object == object; ++k)
        object_shift += contacts[k].share * contacts[k].contact.normal;
    }
    Vec3 shift = object_shift;
    tick.state.parts[contacts[i].part].share = contacts[i].share * contacts[i].contact.normal;
    shift = tick.template place<kFriction>(contacts[i], shift);
    if (i == 0 || contacts[i].contact.depth > contacts[deepest].contact.depth) {
      deepest = i;
      deepest_shift = shift;
    }
  }
  const Loads loads =
      sum_loads<Probe::kSegment, kFriction>(std::span<const LoadedContact>(contacts), tick.probe);
  return give(tick, loads, contacts[deepest], deepest_shift, contacts.size());
}

/// The same of one contact.
template <class Probe, bool kFriction>
[[gnu::always_inline]] inline Rendering add_up(const Tick<Probe>& tick, LoadedContact& contact) {
  const Vec3 shift =
      tick.template place<kFriction>(contact, contact.share * contact.contact.normal);
  const Loads loads = sum_loads<Probe::kSegment, kFriction>(
      std::span<const LoadedContact, 1>(&contact, 1), tick.probe);
  return give(tick, loads, contact, shift, 1);
}

/// All parts on the list of those in reach: their contacts into state.contacts.
template <class Probe>
void touch_listed(Tick<Probe>& tick) {
  tick.state.contacts.clear();
  const std::span<const std::uint32_t> near(tick.state.near_parts);
  for (std::size_t begin = 0, end = 0; begin < near.size(); begin = end) {
    const int object = tick.scene.parts()[near[begin]].object;
    for (end = begin + 1; end < near.size() && tick.scene.parts()[near[end]].object == object;)
      ++end;
    if (end - begin == 1) {
      tick.state.parts[near[begin]].yielded = Vec3(0);
      tick.template touch<false>(near[begin], Vec3(0));
    } else {
      Compound<Probe>{tick, near.subspan(begin, end - begin)}.touch();
    }
  }
}

/// A tick that does what kNeeds says and no more.
template <class Probe, Needs kNeeds>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) noexcept {
  if (!plausible(probe.tip) || !plausible(probe.tail))
    return nothing(state.last, render_fault::kNonFinite);
  Tick<Probe> tick{scene, state, probe, Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0};
  const auto feel_all = [&](std::span<LoadedContact> contacts) {
    if constexpr (!kNeeds.plain_springs())
      feel<kNeeds>(scene, state, probe, contacts, dt > 0 ? 1 / dt : 0);
    state.last = probe;
    state.has_last = true;
  };
  if constexpr (kNeeds.several_parts) {
    survey(scene, state, probe);
    touch_listed(tick);
    const std::span<LoadedContact> contacts(state.contacts);
    load(contacts);
    feel_all(contacts);
    if (!contacts.empty()) return add_up<Probe, kNeeds.friction>(tick, contacts);
  } else {
    LoadedContact contact;
    if (tick.template contact<false>(0, Vec3(0), contact)) {
      const std::span<LoadedContact, 1> contacts(&contact, 1);
      load(contacts);
      feel_all(contacts);
      return add_up<Probe, kNeeds.friction>(tick, contact);
    }
    feel_all({});
  }
  return nothing(probe, tick.faults);
}

/// The least tick that shows the scene.
template <class Probe>
Rendering render(const Scene& scene, RenderState& state, const LineProbe& probe,
                 double dt) noexcept {
  using Run = Rendering (*)(const Scene&, RenderState&, const LineProbe&, double) noexcept;
  static constexpr auto kTicks = []<std::size_t... i>(std::index_sequence<i...>) {
    return std::array<Run, Needs::kCount>{&render<Probe, Needs::of(i)>...};
  }
  (std::make_index_sequence<Needs::kCount>());
  return kTicks[scene.needs_index()](scene, state, probe, dt);
}

}  // namespace palpate::rendering::tick
