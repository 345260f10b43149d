#pragma once
// What materials add to plain springs: layers, damping, friction. Included by tick.h and by what
// measures it.

#include <algorithm>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/force.h"
#include "rendering/scene.h"

namespace palpate::rendering::tick {

/// A part that takes over the contact from another part of the same object, at the seam between
/// them, takes over its friction as well. Then forgets who was in contact.
inline void hand_over_friction(const Scene& scene, RenderState& state,
                               std::span<const LoadedContact> contacts) {
  const auto& parts = scene.parts();
  const auto of_sibling = [&](const LoadedContact& c) {
    for (const std::uint32_t i : state.near_parts) {
      if (parts[i].object == c.object && state.parts[i].friction.in_contact)
        return state.parts[i].friction;
    }
    return FrictionState{};
  };
  for (const auto& c : contacts) {
    FrictionState& friction = state.parts[c.part].friction;
    if (!friction.in_contact) friction = of_sibling(c);
  }
  for (const std::uint32_t i : state.near_parts) state.parts[i].friction.in_contact = false;
}

/// Changes the loaded contacts' forces by what the materials of their parts ask for.
/// \param probe  the virtual probe, world frame
/// \param rate   1/s, ticks; 0 when unknown: no damping
template <TickFeatures kFeatures>
[[gnu::always_inline]] inline void apply_material_forces(const Scene& scene, RenderState& state,
                                                         const LineProbe& probe,
                                                         std::span<LoadedContact> contacts,
                                                         double rate) {
  if constexpr (kFeatures.friction) hand_over_friction(scene, state, contacts);
  for (auto& c : contacts) {
    const stimuli::Material& material = scene.parts()[c.part].material;
    if constexpr (kFeatures.layers) {
      if (!material.layers.empty()) c.force = layered_force(material, c.normal_displacement);
    }
    if constexpr (kFeatures.damping || kFeatures.friction) {
      const LineProbe& last = state.has_last ? state.last : probe;
      const Vec3 motion = (1 - c.probe_fraction) * (probe.tip - last.tip) +
                          c.probe_fraction * (probe.tail - last.tail);
      if (kFeatures.damping && material.damping > 0 && c.normal_displacement > 0) {
        const double closing_speed = -glm::dot(motion, c.contact.normal) * rate;
        c.force = std::max(0.0, c.force + material.damping * closing_speed);
      }
      if (kFeatures.friction && material.has_friction())
        apply_friction(c, material, motion, state.parts[c.part].friction);
    }
  }
}

}  // namespace palpate::rendering::tick
