#pragma once
// Where a tool touched in a tick, for who draws it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rendering/renderer.h"

namespace palpate::runner {

/// A place where the tool touches with force.
struct ContactPlace {
  Vec3 place;  ///< m, on the ideal tool
  Vec3 force;  ///< N, on the tool
};

/// The first places of a tick, as many as there is room for; of a scene in which something rigid
/// moves the deepest alone, with all of the force. No allocation.
/// \param state  after the tick
/// \return how many
std::size_t find_contact_places(const rendering::Scene& scene, const rendering::RenderState& state,
                                const rendering::Rendering& rendering,
                                std::span<ContactPlace> out) noexcept;

struct TouchedPlaces {
  std::int64_t time_ns = 0;  ///< of the sample that they belong to
  std::size_t count = 0;
  std::array<ContactPlace, 32> places{};
};

}  // namespace palpate::runner
