#include "runner/servo/touched_places.h"

#include <glm/geometric.hpp>

#include "rendering/bodies/soft/soft_scene.h"

namespace palpate::runner::servo {
namespace {

constexpr double kOwnForce = 1e-9;  // N; on rigid objects beside soft ones, less is rounding

class Places {
 public:
  explicit Places(std::span<ContactPlace> out) : out_(out) {}
  void add(const Vec3& place, const Vec3& force) noexcept {
    if (count_ < out_.size()) out_[count_++] = {place, force};
  }
  void add(const Vec3& place, const rendering::LoadedContact& contact) noexcept {
    add(place,
        contact.force * contact.contact.normal + contact.stiffness * contact.tangential_offset);
  }
  std::size_t count() const noexcept { return count_; }

 private:
  std::span<ContactPlace> out_;
  std::size_t count_ = 0;
};

/// All places on soft objects; on rigid objects the deepest place, with the rest of the force.
void add_soft(const rendering::RenderState& state, const rendering::Rendering& rendering,
              Places& places) noexcept {
  Vec3 rest = rendering.force;
  rendering::for_each_soft_contact(state, [&](const Vec3& place, const Vec3& force) {
    places.add(place, force);
    rest -= force;
  });
  if (glm::length(rest) > kOwnForce) places.add(rendering.deepest.point, rest);
}

}  // namespace

std::size_t find_contact_places(const rendering::Scene& scene, const rendering::RenderState& state,
                                const rendering::Rendering& rendering,
                                std::span<ContactPlace> out) noexcept {
  Places places(out);
  if (rendering.contacts == 0) return 0;
  if (!rendering::soft_objects(scene).empty()) {
    add_soft(state, rendering, places);
  } else if (scene.motion() == nullptr && scene.features().unions) {
    for (const rendering::PlacedContact& c : state.unions.contacts)
      places.add(c.place + c.loaded.tangential_offset, c.loaded);
  } else if (scene.motion() == nullptr && scene.features().several_parts) {
    for (const rendering::LoadedContact& c : state.contacts) places.add(c.contact.point, c);
  } else {
    places.add(rendering.deepest.point, rendering.force);
  }
  return places.count();
}

}  // namespace palpate::runner::servo
