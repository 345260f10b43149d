#include "rendering/union_contact.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/ideal_tool.h"
#include "rendering/render_fault.h"

namespace palpate::rendering {
namespace {

/// Where no contact has force, show an ideal tool that lags behind in turning: the virtual one may
/// be inside a part.
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

namespace {

/// m, the farthest that any point of the tool moves from one pose to another.
double motion_of(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
                 const PlacedTool& placed_to) {
  double most = 0;
  for (std::size_t j = 0; j < placed_to.count; ++j) {
    const Vec3 start =
        to.tip + placed_to.segments[j].from - from.tip - placed_from.segments[j].from;
    most = std::max(
        {most, glm::length(start),
         glm::length(start + placed_to.segments[j].along - placed_from.segments[j].along)});
  }
  return most;
}

}  // namespace

/// The pose at which a tool that comes from free space meets the first part; the virtual pose if it
/// meets none.
ToolPose IdealTool::first_contact(const ToolPose& from, bool& entered) {
  PlacedTool& before = all_.before;
  pairs_.place(from, before);
  const PlacedTool& after = pairs_.now();
  pairs_.collect(from, before, motion_of(from, before, tick_.tool, after), 0);
  Entry first;
  const NearPair* at = nullptr;
  for (NearPair& near : pairs_.all()) {
    const Entry entry =
        pairs_.sweep(near, pairs_.shrunk(near, from.tip, before.segments[near.segment]),
                     pairs_.shrunk(near, tick_.tool.tip, after.segments[near.segment]));
    if (!entry.entered) continue;
    pairs_.state_of(near).feature = entry.feature;
    if (entry.time >= first.time) continue;
    first = entry;
    at = &near;
  }
  entered = at != nullptr;
  if (!entered) return tick_.tool;
  ToolPose pose = between(from, tick_.tool, first.time);
  // The rest of the turn is about the contact.
  const PlacedSegment segment = pairs_.placed(pose, at->segment);
  const LineProbe local = pairs_.shrunk(*at, pose.tip, segment);
  const WalkResult contact =
      measure(*pairs_.part_of(*at).mesh, first.feature, local.tip, local.tail - local.tip);
  const Vec3 grasp = segment.from + contact.probe_fraction * segment.along;
  memory_.grasp =
      carried_ != nullptr ? glm::transpose(pose.frame) * grasp : Vec3(0, 0, contact.probe_fraction);
  return pose;
}

Plane IdealTool::plane_of(std::uint32_t index, ContactFeature feature) const {
  const NearPair& near = pairs_[index];
  const ScenePart& part = pairs_.part_of(near);
  const WalkResult at = measure(*part.mesh, feature, near.true_tip, near.true_d);
  Plane plane;
  plane.near = index;
  plane.feature =
      at.feature.kind != ContactFeature::Kind::none ? at.feature : at.separating_feature;
  plane.normal = part.world_vector(at.normal);
  plane.depth = at.depth;
  return plane;
}

void IdealTool::follow() {
  ToolPose from = memory_.ideal;
  if (!memory_.touching) {
    bool entered = false;
    from = first_contact(tick_.state.has_last ? all_.last : tick_.tool, entered);
    if (!entered) return;
  }
  // Halve a turn that leads into a crack or finds no rest.
  double most = 1;
  do {
    most = 0.5 * turn(from, most);
    stuck_ = false;
    resume_planes();
    translate();
  } while (most > 0 && (stuck_ || in_crack_ || !planes_.leave_room()));
  const std::size_t first_contact = all_.contacts.size();
  add_contacts();
  remember(first_contact);
}

void follow_ideal_tool(UnionTick& tick, std::uint32_t group) { IdealTool(tick, group).follow(); }

bool inside_group(UnionTick& tick, std::uint32_t group) {
  return NearPairs(tick, tick.scene.groups()[group]).virtual_inside();
}

}  // namespace palpate::rendering
