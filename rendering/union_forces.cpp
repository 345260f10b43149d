#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/render_fault.h"
#include "rendering/union_contact.h"

namespace palpate::rendering {
namespace {

/// Where no contact has force, an ideal tool that is behind in turning is not the virtual one: that
/// may be inside of a part.
void show_behind(const UnionMemory& all, bool tool, const Vec3& tip, Rendering& out) {
  if (!(all.most_lag > 0)) return;
  const GroupState& group = all.groups[all.most_behind];
  out.ideal.tip = tip + group.shift;
  out.ideal.tail = out.ideal.tip + group.ideal.d;
  if (tool) out.ideal_side = group.ideal.frame[0];
}

}  // namespace

Vec3 tail_force(const Vec3& torque, double along, const Vec3& d) {
  const double length = glm::length(d);
  if (!(length > 0)) return Vec3(0);
  const Vec3 u = d / length;
  return (glm::cross(torque, u) + along * u) / length;
}

Rendering sum_unions(const UnionTick& tick, const LineProbe& probe) {
  const UnionMemory& all = tick.state.unions;
  const bool tool = tick.scene.tool() != nullptr;
  Rendering out;
  out.ideal = probe;
  if (tool) out.ideal_side = tick.tool.frame[0];
  const PlacedContact* deepest = nullptr;
  const double length = glm::length(tick.tool.d);
  double along = 0;  // N m, sum of each contact's lever times its force along the stylus
  for (const PlacedContact& c : all.contacts) {
    const Vec3 force =
        c.loaded.force * c.loaded.contact.normal + c.loaded.stiffness * c.loaded.tangential_offset;
    out.force += force;
    if (tick.sides) {
      const Vec3 lever = c.place + c.loaded.tangential_offset - probe.tip;
      out.torque += glm::cross(lever, force);
      if (tool && length > 0)
        along += glm::dot(lever, tick.tool.d) * glm::dot(force, tick.tool.d) / (length * length);
      if (!tool) out.device2 += c.loaded.probe_fraction * force;
    }
    if (deepest == nullptr || c.loaded.contact.depth > deepest->loaded.contact.depth) deepest = &c;
  }
  if (tool && tick.sides) out.device2 = tail_force(out.torque, along, tick.tool.d);
  out.device1 = out.force - out.device2;
  out.contacts = static_cast<int>(all.contacts.size());
  out.faults = tick.faults;
  if (deepest == nullptr) {
    show_behind(all, tool, probe.tip, out);
    return out;
  }
  const Vec3 shift = deepest->shift + deepest->loaded.tangential_offset;
  const GroupState& group = all.groups[deepest->group];
  out.deepest = deepest->loaded.contact;
  out.deepest.point = deepest->place + deepest->loaded.tangential_offset;
  out.object = deepest->loaded.object;
  out.ideal = {probe.tip + shift, probe.tail + shift};
  if (deepest->by_law) out.ideal.tail = out.ideal.tip + group.ideal.d;
  if (tool) {
    out.segment = deepest->segment;
    out.ideal_side = group.ideal.frame[0];
    out.deepest.along =
        length > 0 ? glm::dot(out.deepest.point - out.ideal.tip, group.ideal.d) / length : 0;
  } else if (tick.sides) {
    out.deepest.along = deepest->loaded.probe_fraction * length;
  }
  const Vec3 sum = out.force + out.torque + out.device2;
  if (std::isfinite(sum.x + sum.y + sum.z)) return out;
  Rendering none;
  none.ideal = probe;
  none.faults = tick.faults | render_fault::kNonFinite;
  return none;
}

}  // namespace palpate::rendering
