#pragma once
// Places where a tool touched in a tick, for drawing.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rendering/renderer.h"

namespace palpate::runner::servo {

/// A place where the tool touches with force.
struct ContactPlace {
  Vec3 place;  ///< m, on the ideal tool
  Vec3 force;  ///< N, on the tool
};

/// The first places of a tick, up to the capacity. In a scene with a rigid moving object: the
/// deepest only, with the total force. Does not allocate.
/// \param state  after the tick
/// \return the number found
std::size_t find_contact_places(const rendering::Scene& scene, const rendering::RenderState& state,
                                const rendering::Rendering& rendering,
                                std::span<ContactPlace> out) noexcept;

struct TouchedPlaces {
  std::int64_t time_ns = 0;  ///< of the sample of these places
  std::size_t count = 0;
  std::array<ContactPlace, 32> places{};
};

}  // namespace palpate::runner::servo
