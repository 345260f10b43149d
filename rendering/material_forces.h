#pragma once
// What materials add to plain springs: damping, friction. Included by tick.h and by what
// measures it.

#include <algorithm>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/force.h"
#include "rendering/scene.h"

namespace palpate::rendering::tick {

/// What the material of a contact makes of its force.
/// \param motion  m, of the probe at the contact since the last tick
/// \param rate    1/s, ticks; 0 when unknown: no damping
template <TickFeatures kFeatures>
[[gnu::always_inline]] inline void apply_material(LoadedContact& c,
                                                  const stimuli::Material& material,
                                                  const Vec3& motion, double rate,
                                                  FrictionState& friction) {
  if (kFeatures.damping && material.damping > 0 && c.normal_displacement > 0) {
    const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
    c.force = std::max(0.0, c.force + material.damping * closing_speed);
  }
  if (kFeatures.friction && material.has_friction()) apply_friction(c, material, motion, friction);
}

/// Changes the loaded contacts' forces by what the materials of their parts ask for.
/// \param probe  the virtual probe, world frame
template <TickFeatures kFeatures>
[[gnu::always_inline]] inline void apply_material_forces(const Scene& scene, RenderState& state,
                                                         const LineProbe& probe,
                                                         std::span<LoadedContact> contacts,
                                                         double rate) {
  if constexpr (kFeatures.friction) {
    for (const auto& c : contacts) {
      FrictionState& friction = state.parts[c.part].friction;
      if (!friction.in_contact) friction = {};
    }
    for (const std::uint32_t i : state.near_parts) state.parts[i].friction.in_contact = false;
  }
  for (auto& c : contacts) {
    const LineProbe& last = state.has_last ? state.last : probe;
    const Vec3 motion = (1 - c.probe_fraction) * (probe.tip - last.tip) +
                        c.probe_fraction * (probe.tail - last.tail);
    apply_material<kFeatures>(c, scene.parts()[c.part].material, motion, rate,
                              state.parts[c.part].friction);
  }
}

/// The same for contacts of the law of unions. A pair of part and segment that takes over the
/// contact from another of its group, at the seam between them, takes over its friction as well.
template <TickFeatures kFeatures>
void apply_material_forces(const Scene& scene, RenderState& state,
                           std::span<PlacedContact> contacts, double rate) {
  UnionMemory& all = state.unions;
  const auto friction_of = [&](const PlacedContact& c) -> FrictionState& {
    return c.by_law ? all.pairs[c.pair].friction : state.parts[c.loaded.part].friction;
  };
  if constexpr (kFeatures.friction) {
    for (const PlacedContact& c : contacts) {
      FrictionState& friction = friction_of(c);
      if (friction.in_contact) continue;
      friction = {};
      for (const RubbedPair& was : all.rubbed) {
        if (c.by_law && was.group == c.group) friction = all.pairs[was.pair].friction;
      }
    }
    for (const RubbedPair& was : all.rubbed) all.pairs[was.pair].friction.in_contact = false;
    for (const std::uint32_t i : state.near_parts) state.parts[i].friction.in_contact = false;
    all.rubbed.clear();
  }
  for (PlacedContact& c : contacts) {
    FrictionState& friction = friction_of(c);
    apply_material<kFeatures>(c.loaded, scene.material_of(c.loaded.part), c.motion, rate, friction);
    if (kFeatures.friction && c.by_law && friction.in_contact)
      all.rubbed.push_back({c.group, c.pair});
  }
}

}  // namespace palpate::rendering::tick
