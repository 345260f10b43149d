#include <algorithm>
#include <glm/geometric.hpp>

#include "rendering/render_fault.h"
#include "rendering/texture.h"
#include "rendering/union_contact.h"

namespace palpate::rendering {
namespace {

/// The frame in which a contact's texture is.
struct Frame {
  Mat3 to_world;
  Vec3 position;
  Vec3 vector(const Vec3& world) const { return glm::transpose(to_world) * world; }
  Vec3 point(const Vec3& world) const { return vector(world - position); }
};

Frame frame_of(const Scene& scene, const PlacedContact& c) {
  const std::uint32_t surface = scene.groups()[c.group].surface;
  if (surface != PartGroup::kParts)
    return {scene.surfaces()[surface].to_world, scene.surfaces()[surface].position};
  const ScenePart& part = scene.parts()[c.loaded.part];
  return {part.to_world, part.position};
}

/// The place of the last tick nearest to a contact, on its segment, and takes it. Not that of the
/// pair of part and segment: beside a seam another pair goes on.
TextureState last_place(CarvedGroup& group, const PlacedContact& c) {
  CarvedGroup::Held* best = nullptr;
  double nearest = HUGE_VAL;
  for (std::size_t i = 0; i < group.count; ++i) {
    CarvedGroup::Held& held = group.held[i];
    const Vec3 apart = held.place - c.place;
    const double away = glm::dot(apart, apart);
    if (held.taken || held.segment != c.segment || away >= nearest) continue;
    nearest = away;
    best = &held;
  }
  if (best == nullptr) return {};
  best->taken = true;
  return {best->place, true};
}

}  // namespace

void carve_placed_contacts(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  std::size_t kept = 0;
  for (std::size_t first = 0; first < all.contacts.size();) {
    const std::uint32_t of = all.contacts[first].group;
    std::size_t end = first;
    while (end < all.contacts.size() && all.contacts[end].group == of) ++end;
    CarvedGroup& group = all.carved[of];
    CarvedGroup now;
    const std::size_t first_kept = kept;
    Vec3 moved(0);  // m, of the ideal tool
    for (std::size_t i = first; i < end; ++i) {
      PlacedContact c = all.contacts[i];
      const auto& texture = tick.scene.material_of(c.loaded.part).texture;
      if (!c.by_law || texture == nullptr) {
        all.contacts[kept++] = c;
        continue;
      }
      const Frame frame = frame_of(tick.scene, c);
      TextureState state = last_place(group, c);
      state.place = frame.point(state.place);
      const SmoothContact smooth{frame.vector(c.loaded.contact.normal),
                                 c.loaded.normal_displacement,
                                 frame.point(c.place),
                                 frame.vector(c.edge),
                                 frame.vector(c.along),
                                 frame.vector(c.window)};
      const CarvedContact carved = carve(*texture, smooth, state);
      if (carved.lost) tick.faults |= render_fault::kTextureLost;
      if (!carved.touches) continue;
      now.held[now.count++] = {frame.to_world * state.place + frame.position, c.segment, false};
      const Vec3 shift = frame.to_world * carved.shift;
      moved += shift - c.loaded.normal_displacement * c.loaded.contact.normal;
      const double length = glm::length(shift);
      if (c.loaded.normal_displacement > 0)
        c.loaded.contact.depth *= length / c.loaded.normal_displacement;
      c.loaded.contact.normal = shift / length;
      c.loaded.normal_displacement = length;
      c.loaded.force = c.loaded.stiffness * length;
      all.contacts[kept++] = c;
    }
    for (std::size_t i = first_kept; i < kept; ++i) {
      if (!all.contacts[i].by_law) continue;
      all.contacts[i].shift += moved;
      all.contacts[i].place += moved;
    }
    group = now;
    group.seen = true;
    first = end;
  }
  all.contacts.resize(kept);
  for (CarvedGroup& group : all.carved) {
    if (!group.seen) group.count = 0;
    group.seen = false;
  }
}

}  // namespace palpate::rendering
