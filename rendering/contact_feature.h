#pragma once
// What of a convex object a probe touches.

#include <bit>
#include <cstdint>

namespace palpate::rendering {

/// A facet of M (facet_walk.h), by the feature of the object that it comes from. Packed into one
/// word, because every step copies it: memory that was written in parts is slow to read back.
struct ContactFeature {
  enum class Kind : std::uint32_t {
    none,   ///< no contact
    facet,  ///< of the object, with the deeper end of the probe
    edge,   ///< silhouette edge of the object, with the direction of the probe
  };
  ContactFeature() = default;
  ContactFeature(Kind k, bool ahead, std::uint32_t i)
      : ContactFeature(std::bit_cast<ContactFeature>(static_cast<std::uint32_t>(k) |
                                                     std::uint32_t{ahead} << 2 | i << 3)) {}

  Kind kind : 2 = Kind::none;
  /// Edge only: which of its two facets faced the tail (dot(normal, d) >= 0, d = tail - tip) at the
  /// last tick.
  bool left_ahead : 1 = false;
  std::uint32_t index : 29 = 0;  ///< of the facet or edge, in the mesh

  friend bool operator==(ContactFeature a, ContactFeature b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  }
};

}  // namespace palpate::rendering
