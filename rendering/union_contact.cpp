#include "rendering/union_contact.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "rendering/ideal_tool.h"

namespace palpate::rendering {
namespace {

/// m; how far any point of the tool is from one pose to another at most.
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

/// The pose at which a tool that comes from free space meets the first part; the virtual one where
/// it meets none.
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
  // It turns on about where it touches.
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
  // A turn that leads into a crack, or to no rest, is halved.
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
