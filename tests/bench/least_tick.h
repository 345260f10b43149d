#pragma once
// Pipelines that lack what a scene does not ask for, written without the renderers' general tick:
// the yardsticks of feature_cost. They share the walk, the approach and the mesh with it.

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/renderer.h"
#include "rendering/tick.h"

namespace palpate::bench {

template <class Probe>
[[gnu::always_inline]] inline LineProbe in_frame(const ScenePart& part, const LineProbe& probe) {
  const Vec3 tip = part.local_point(probe.tip);
  return {tip, Probe::kSegment ? part.local_point(probe.tail) : tip};
}

/// A part without trees and map that was not in contact at the last tick: whether it is now.
/// \return false in `known` where the approach alone cannot tell
template <class Probe>
bool approached(const ScenePart& part, PartState& memory, const LineProbe& from,
                const LineProbe& to, WalkResult& hit, bool& known) {
  using Kind = MinkowskiFacet::Kind;
  const ConvexMesh& mesh = *part.mesh;
  known = false;
  if (memory.blocked || memory.watch.kind == Kind::none) return false;
  const WalkResult was = tick::walk<Probe>(mesh, memory.watch, from.tip, from.tail - from.tip);
  if (was.facet.kind != Kind::none) return false;
  const Approach way = Probe::approach(mesh, was.separates, from, to);
  if (way.end == Approach::End::separated) {
    known = true;
    memory.plane = way.plane;
    memory.watch = way.facet;
    return false;
  }
  if (way.end != Approach::End::entered) return false;
  hit = tick::walk<Probe>(mesh, way.facet, to.tip, to.tail - to.tip);
  if (hit.unsure) return false;
  known = true;
  if (hit.facet.kind == Kind::none) {
    tick::leave(memory, hit, to);
    return false;
  }
  memory.facet = hit.facet;
  memory.plane.valid = false;
  fetch_ahead(mesh, memory.facet);
  return true;
}

inline Rendering nothing(const LineProbe& ideal, std::uint32_t faults) {
  Rendering out;
  out.ideal = ideal;
  out.faults = faults;
  return out;
}

/// Whether the part was come upon in this tick.
template <class Probe>
bool met(const ScenePart& part, PartState& memory, const RenderState& state, const LineProbe& local,
         WalkResult& hit) {
  if (memory.plane.separates(local.tip, local.tail)) return false;
  if (state.has_last) {
    bool known = false;
    const bool touching =
        approached<Probe>(part, memory, in_frame<Probe>(part, state.last), local, hit, known);
    if (known) return touching;
  }
  return tick::meet<Probe>(part, memory, state.has_last ? &state.last : nullptr, local, hit);
}

/// One convex part of few facets that is a plain spring, and nothing else in the world: no trees,
/// no survey, no list of contacts, no sums, no materials. The point has no torque and no second
/// device.
/// \tparam kTorque  whether there are torque and a second device
template <class Probe, bool kTorque = Probe::kSegment>
[[gnu::flatten]] Rendering least_tick(const Scene& scene, RenderState& state,
                                      const LineProbe& probe, double) noexcept {
  if (!tick::plausible(probe.tip) || !tick::plausible(probe.tail))
    return nothing(state.last, render_fault::kNonFinite);
  const ScenePart& part = scene.parts()[0];
  PartState& memory = state.parts[0];
  const Vec3 tip = part.local_point(probe.tip);
  const Vec3 d = Probe::kSegment ? part.local_vector(probe.tail - probe.tip) : Vec3(0);
  const LineProbe local{tip, tip + d};
  WalkResult hit;
  std::uint32_t faults = 0;
  const bool touching = memory.facet.kind != MinkowskiFacet::Kind::none
                            ? tick::track<Probe>(part, memory, nullptr, local, d, hit, faults)
                            : met<Probe>(part, memory, state, local, hit);
  state.last = probe;
  state.has_last = true;
  if (!touching)
    return nothing(probe, faults | (memory.blocked ? render_fault::kStartedInside : 0));
  LoadedContact c;
  const double length = Probe::kSegment ? glm::length(probe.tail - probe.tip) : 0;
  Probe::describe(*part.mesh, hit, tip, d, length, c);
  const Vec3 normal = part.world_vector(hit.normal);
  const Vec3 force = part.material.stiffness * hit.depth * normal;
  const Vec3 shift = hit.depth * normal;
  Vec3 point = probe.tip + shift, torque, device2;
  if constexpr (Probe::kSegment) {
    point += c.place * (probe.tail - probe.tip);
  }
  if constexpr (kTorque) {
    torque = c.place * glm::cross(probe.tail - probe.tip, force);
    device2 = c.place * force;
  }
  const Vec3 all = force + torque;
  if (!std::isfinite(all.x + all.y + all.z))
    return nothing(probe, faults | render_fault::kNonFinite);
  return {.force = force,
          .torque = torque,
          .device1 = force - device2,
          .device2 = device2,
          .deepest = {point, normal, hit.depth, c.place * length, c.contact.type},
          .ideal = {probe.tip + shift, probe.tail + shift},
          .contacts = 1,
          .object = part.object,
          .faults = faults};
}

}  // namespace palpate::bench
