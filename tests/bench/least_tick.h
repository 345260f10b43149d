#pragma once
// Pipelines that lack what a scene does not ask for, written without the renderers' general tick:
// the yardsticks of feature_cost. They share the walk, the approach and the mesh with it.

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <optional>

#include "rendering/renderer.h"
#include "rendering/tick.h"

namespace palpate::bench {

/// A part without trees and map that was not in contact at the last tick: its contact now.
/// \return nothing where the approach alone cannot tell
template <class Probe>
std::optional<rendering::WalkResult> approached(const rendering::ScenePart& part,
                                                rendering::PartState& memory,
                                                const rendering::LineProbe& from,
                                                const rendering::LineProbe& to) {
  using Kind = rendering::ContactFeature::Kind;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  if (memory.started_inside || memory.nearby.kind == Kind::none) return {};
  const rendering::WalkResult was =
      Probe::walk(mesh, memory.nearby, from.tip, from.tail - from.tip);
  if (was.feature.kind != Kind::none) return {};
  const rendering::Approach way = Probe::approach(mesh, was.separating_feature, from, to);
  if (way.end == rendering::Approach::End::separated) {
    memory.plane = way.plane;
    memory.nearby = way.feature;
    return rendering::WalkResult();
  }
  if (way.end != rendering::Approach::End::entered) return {};
  const rendering::WalkResult hit = Probe::walk(mesh, way.feature, to.tip, to.tail - to.tip);
  if (hit.not_converged) return {};
  if (hit.feature.kind == Kind::none) {
    rendering::tick::record_separation(memory, hit, to);
    return hit;
  }
  memory.feature = hit.feature;
  memory.plane.valid = false;
  rendering::prefetch_neighbours(mesh, memory.feature);
  return hit;
}

inline rendering::Rendering nothing(const rendering::LineProbe& ideal, std::uint32_t faults) {
  rendering::Rendering out;
  out.ideal = ideal;
  out.faults = faults;
  return out;
}

/// The contact of a part that is come upon in this tick; of kind none where there is none.
template <class Probe>
rendering::WalkResult met(const rendering::ScenePart& part, rendering::PartState& memory,
                          const rendering::RenderState& state, const rendering::LineProbe& local) {
  if (memory.plane.separates(local.tip, local.tail)) return {};
  if (state.has_last) {
    const auto hit = approached<Probe>(part, memory, Probe::to_local(part, state.last), local);
    if (hit) return *hit;
  }
  return rendering::tick::detect_contact<Probe>(part, memory,
                                                state.has_last ? &state.last : nullptr, local);
}

/// One convex part of few facets that is a plain spring, and nothing else in the world: no trees,
/// no broad phase, no list of contacts, no sums, no materials. The point has no torque and no
/// second device. \tparam kTorque  whether there are torque and a second device
template <class Probe, bool kTorque = Probe::kSegment>
[[gnu::flatten]] rendering::Rendering least_tick(const rendering::Scene& scene,
                                                 rendering::RenderState& state,
                                                 const rendering::LineProbe& probe,
                                                 double) noexcept {
  if (!rendering::tick::within_range(probe.tip) || !rendering::tick::within_range(probe.tail))
    return nothing(state.last, rendering::render_fault::kNonFinite);
  const rendering::ScenePart& part = scene.parts()[0];
  rendering::PartState& memory = state.parts[0];
  const Vec3 tip = part.local_point(probe.tip);
  const Vec3 d = Probe::kSegment ? part.local_vector(probe.tail - probe.tip) : Vec3(0);
  std::uint32_t faults = 0;
  const rendering::WalkResult hit =
      memory.feature.kind != rendering::ContactFeature::Kind::none
          ? rendering::tick::track<Probe>(part, memory, nullptr, tip, d, faults)
          : met<Probe>(part, memory, state, {tip, tip + d});
  state.last = probe;
  state.has_last = true;
  if (hit.feature.kind == rendering::ContactFeature::Kind::none)
    return nothing(probe,
                   faults | (memory.started_inside ? rendering::render_fault::kStartedInside : 0));
  rendering::LoadedContact c;
  const double length = Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0;
  Probe::classify(*part.mesh, hit, tip, d, length, c);
  const Vec3 normal = part.world_vector(hit.normal);
  const Vec3 force = part.material.stiffness * hit.depth * normal;
  const Vec3 shift = hit.depth * normal;
  Vec3 point = probe.tip + shift, torque, device2;
  if constexpr (Probe::kSegment) {
    point += c.probe_fraction * (probe.tail - probe.tip);
  }
  if constexpr (kTorque) {
    torque = c.probe_fraction * glm::cross(probe.tail - probe.tip, force);
    device2 = c.probe_fraction * force;
  }
  const Vec3 all = force + torque;
  if (!std::isfinite(all.x + all.y + all.z))
    return nothing(probe, faults | rendering::render_fault::kNonFinite);
  return {.force = force,
          .torque = torque,
          .device1 = force - device2,
          .device2 = device2,
          .deepest = {point, normal, hit.depth, c.probe_fraction * length, c.contact.type},
          .ideal = {probe.tip + shift, probe.tail + shift},
          .contacts = 1,
          .object = part.object,
          .faults = faults};
}

}  // namespace palpate::bench
