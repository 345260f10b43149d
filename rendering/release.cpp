#include "rendering/release.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/render_fault.h"
#include "rendering/surface_contact.h"

namespace palpate::rendering {
namespace {

/// Forgets the contacts with the k-th part of a group.
void forget_part(UnionTick& tick, const PartGroup& group, std::size_t k) {
  const std::size_t segments = tick.scene.segments();
  for (std::size_t j = 0; j < segments; ++j) {
    PairState& pair = tick.state.unions.pairs[group.first_pair + k * segments + j];
    pair.carries = false;
    pair.plane.valid = false;
    pair.friction = {};
  }
}

/// Forgets the contacts of the group's ideal tool: from now on it is the virtual one.
void forget_contacts(UnionTick& tick, std::uint32_t index) {
  const PartGroup& group = tick.scene.groups()[index];
  tick.state.unions.groups[index].touching = false;
  tick.state.unions.groups[index].lag = 0;
  if (group.surface != PartGroup::kParts)
    tick.state.unions.surfaces[group.surface].carrying_count = 0;
  for (std::size_t k = 0; k < group.part_count; ++k) forget_part(tick, group, k);
}

/// Whether the virtual tool is outside of the surface and all layers of an object.
bool left(UnionTick& tick, std::uint32_t object) {
  for (std::uint32_t i = 0; i < tick.scene.groups().size(); ++i) {
    const PartGroup& group = tick.scene.groups()[i];
    if (!group.by_law || group.object_state != object) continue;
    if (group.surface != PartGroup::kParts ? inside_surface(tick, group.surface)
                                           : inside_group(tick, i))
      return false;
  }
  return true;
}

void restore(UnionTick& tick, std::size_t breaking) {
  UnionMemory& all = tick.state.unions;
  GroupState& group = all.groups[tick.scene.breaking()[breaking].group];
  all.breaking[breaking] = {};
  group.strength = 1;
  group.parts_went = false;
}

void restore_layers(UnionTick& tick, std::uint32_t object) {
  for (std::size_t i = 0; i < tick.scene.breaking().size(); ++i) {
    if (tick.scene.breaking()[i].object_state == object) restore(tick, i);
  }
}

void switch_off(UnionTick& tick, std::uint32_t object) {
  tick.state.unions.objects[object].off = true;
  for (std::uint32_t i = 0; i < tick.scene.groups().size(); ++i) {
    if (tick.scene.groups()[i].object_state == object) forget_contacts(tick, i);
  }
}

/// s; 1 ms where the clock does not run.
double step_of(const UnionTick& tick) { return tick.dt > 0 ? tick.dt : 1e-3; }

void release_hooked(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (ObjectState& object : all.objects) object.lag = 0;
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    double& lag = all.objects[tick.scene.groups()[g].object_state].lag;
    lag = std::max(lag, all.groups[g].lag);
  }
  for (ObjectState& object : all.objects) {
    object.lagging = object.lag > kMostLag ? object.lagging + step_of(tick) : 0;
    if (object.lagging > kMostLagTime) object.releasing = true;
    if (!object.releasing) continue;
    tick.faults |= render_fault::kReleased;
    object.strength = std::max(0.0, object.strength - step_of(tick) / kFadeTime);
  }
}

/// Null: the contact's part never breaks.
BreakState* breaking_of(UnionTick& tick, const PlacedContact& contact) {
  if (contact.loaded.part >= tick.scene.parts().size()) return nullptr;  // a surface
  const std::uint32_t index = tick.scene.parts()[contact.loaded.part].breaking;
  return index == ScenePart::kHolds ? nullptr : &tick.state.unions.breaking[index];
}

/// Parts whose force has faded no longer hold the ideal tool.
void remove_parts(UnionTick& tick, std::uint32_t breaking) {
  const std::uint32_t index = tick.scene.breaking()[breaking].group;
  const PartGroup& group = tick.scene.groups()[index];
  for (std::uint32_t k = 0; k < group.part_count; ++k) {
    if (tick.scene.parts()[group.first_part + k].breaking == breaking) forget_part(tick, group, k);
  }
  tick.state.unions.groups[index].parts_went = true;
}

/// N, without friction.
Vec3 force_of(const UnionMemory& all, std::uint32_t group) {
  Vec3 force(0);
  for (const PlacedContact& c : all.contacts) {
    if (c.group == group) force += c.loaded.force * c.loaded.contact.normal;
  }
  return force;
}

/// When parts of a layer have gone, their neighbours' force rises smoothly: the tool may be deep in
/// them by then.
void raise_forces(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    GroupState& group = all.groups[g];
    if (!group.parts_went && group.strength == 1) continue;
    if (group.parts_went) {
      const double now = glm::length(force_of(all, g));
      group.strength = now > group.last_force ? group.last_force / now : 1;
      group.parts_went = false;
    } else {
      group.strength = std::min(1.0, group.strength + step_of(tick) / kFadeTime);
    }
  }
}

/// Layers whose force exceeds their break force begin to break.
void break_layers(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (BreakState& parts : all.breaking) parts.force = Vec3(0);
  for (const PlacedContact& c : all.contacts) {
    if (BreakState* const parts = breaking_of(tick, c))
      parts->force += c.loaded.force * c.loaded.contact.normal;
  }
  for (std::size_t i = 0; i < all.breaking.size(); ++i) {
    BreakState& parts = all.breaking[i];
    const double most = tick.scene.breaking()[i].force;
    if (glm::dot(parts.force, parts.force) > most * most) {
      parts.giving_way = true;
      all.exceptions = true;
    }
    if (!(parts.giving_way && parts.strength > 0)) continue;
    parts.strength = std::max(0.0, parts.strength - step_of(tick) / kFadeTime);
    if (parts.strength == 0) remove_parts(tick, static_cast<std::uint32_t>(i));
  }
}

}  // namespace

bool is_off(const UnionTick& tick, const PartGroup& group) {
  const ObjectState& object = tick.state.unions.objects[group.object_state];
  return !group.felt || object.off || object.just_left;
}

void update_objects(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  if (!all.exceptions && tick.state.has_last) return;
  all.exceptions = false;
  for (std::uint32_t i = 0; i < all.objects.size(); ++i) {
    ObjectState& object = all.objects[i];
    object.just_left = false;
    if (!tick.state.has_last && !left(tick, i)) {
      object.started_inside = true;
      switch_off(tick, i);
    } else if (object.off && left(tick, i)) {
      object = {};
      object.just_left = true;
      restore_layers(tick, i);
    }
    if (object.off)
      tick.faults |= object.started_inside ? render_fault::kStartedInside : render_fault::kReleased;
    all.exceptions |= object.off || object.just_left || object.releasing || object.lagging > 0;
  }
  for (std::size_t i = 0; i < all.breaking.size(); ++i) {
    const std::uint32_t object = tick.scene.breaking()[i].object_state;
    if (!all.breaking[i].giving_way) continue;
    // Restore them a tick later, so that the ideal tool comes from outside. It may be inside them
    // if the virtual one has passed right through the object.
    if (all.breaking[i].was_left) {
      restore(tick, i);
    } else {
      const bool held = all.groups[tick.scene.breaking()[i].group].touching;
      all.breaking[i].was_left = !all.objects[object].off && !held && left(tick, object);
    }
    all.exceptions |= all.breaking[i].giving_way;
  }
}

void fade_forces(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  if (!all.breaking.empty()) {
    raise_forces(tick);
    break_layers(tick);
  }
  if (!all.exceptions) return;
  release_hooked(tick);
  for (PlacedContact& c : all.contacts) {
    const std::uint32_t object = tick.scene.groups()[c.group].object_state;
    const BreakState* const parts = breaking_of(tick, c);
    const double strength = all.objects[object].strength * all.groups[c.group].strength *
                            (parts != nullptr ? parts->strength : 1);
    c.loaded.force *= strength;
    c.loaded.stiffness *= strength;  // of friction
  }
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    if (all.groups[g].parts_went) all.groups[g].last_force = glm::length(force_of(all, g));
  }
  for (std::uint32_t i = 0; i < all.objects.size(); ++i) {
    ObjectState& object = all.objects[i];
    if (object.releasing && object.strength == 0 && !object.off) switch_off(tick, i);
  }
}

}  // namespace palpate::rendering
