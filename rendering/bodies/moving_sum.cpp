// The wrench of all that is touched, bodies with what stands still. Part of moving_bodies.h.

#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/moving_bodies.h"
#include "rendering/render_fault.h"

namespace palpate::rendering {

/// Adds what one body does to the hand.
void MovingBodies::add_body(const Renderer& renderer, const BodiesState& state, std::size_t body,
                            const LineProbe& probe, Rendering& out) const {
  const Rendering& felt = state.felt[body];
  const bool tool = fixed_.tool() != nullptr;
  const Quat& turn = state.shown[body].orientation;
  out.faults |= felt.faults;
  const ProbeContact* deepest = nullptr;
  Vec3 torque(0);
  double along = 0;  // N m, as in sum_unions
  const Vec3 d = probe.tail - probe.tip;
  const double length2 = glm::dot(d, d);
  for (const ProbeContact& c : state.contacts) {
    if (c.spring.body != body || !(c.force > 0)) continue;
    const Vec3 force = c.force * c.spring.normal + c.tangential;
    const Vec3 place = c.on_probe + c.felt_depth * c.spring.normal + c.offset;
    out.force += force;
    ++out.contacts;
    if (renderer.side_contact()) {
      torque += glm::cross(place - probe.tip, force);
      if (tool && length2 > 0)
        along += glm::dot(place - probe.tip, d) * glm::dot(force, d) / length2;
      if (!tool) out.device2 += c.along * force;
    }
    if (deepest == nullptr || c.felt_depth > deepest->felt_depth) deepest = &c;
  }
  out.torque += torque;
  if (tool && renderer.side_contact()) out.device2 += tail_force(torque, along, d);
  if (deepest == nullptr || (out.object >= 0 && deepest->felt_depth <= out.deepest.depth)) return;
  Vec3 shift = deepest->offset;
  for (const ProbeContact& c : state.contacts) {
    if (c.spring.body == body && c.spring.group == deepest->spring.group)
      shift += c.felt_depth * c.spring.normal;
  }
  out.deepest = felt.deepest;
  if (felt.contacts == 0) out.deepest.type = state.held[body].type;
  out.deepest.along = renderer.side_contact() ? deepest->along * std::sqrt(length2) : 0;
  out.deepest.normal = deepest->spring.normal;
  out.deepest.depth = deepest->felt_depth;
  out.deepest.point =
      deepest->on_probe + deepest->felt_depth * deepest->spring.normal + deepest->offset;
  out.ideal.tip = probe.tip + shift;
  out.ideal.tail = out.ideal.tip + turn * (felt.ideal.tail - felt.ideal.tip);
  out.object = world_.bodies[body].object;
  if (tool) {
    out.segment = deepest->segment;
    out.ideal_side = turn * felt.ideal_side;
  }
}

Rendering MovingBodies::sum(const Renderer& renderer, const BodiesState& state,
                            const Rendering& fixed, const LineProbe& probe) const {
  Rendering out = fixed;
  if (state.world.dropped) out.faults |= render_fault::kContactsDropped;
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) add_body(renderer, state, i, probe, out);
  out.device1 = out.force - out.device2;
  const Vec3 all = out.force + out.torque + out.device2;
  if (std::isfinite(all.x + all.y + all.z)) return out;
  Rendering none;
  none.ideal = probe;
  none.faults = out.faults | render_fault::kNonFinite;
  return none;
}

}  // namespace palpate::rendering
