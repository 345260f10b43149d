#pragma once
// The fault bits of a renderer and the one table of their meanings: names in files, words on
// screens and codebooks come from it.

#include <array>
#include <cstdint>

namespace palpate::rendering {

/// The names of a fault bit and its meaning.
struct FaultBit {
  std::uint32_t bit;
  const char* name;      ///< in files
  const char* words;     ///< on a screen
  const char* meaning;   ///< in a codebook
  const char* why = "";  ///< why forces went off, in a sentence; "" if they do not
};

/// Bits of Rendering::faults.
namespace render_fault {
inline constexpr std::uint32_t kNonFinite = 1;
inline constexpr std::uint32_t kStartedInside = 2;
inline constexpr std::uint32_t kWalkCapped = 4;
inline constexpr std::uint32_t kContactsDropped = 8;
// 16 to 2048 are the servo's (runner/servo/sample.h).
inline constexpr std::uint32_t kContactCapped = 4096;
inline constexpr std::uint32_t kReleased = 8192;
inline constexpr std::uint32_t kSoftLate = 16384;
inline constexpr std::uint32_t kSoftStalled = 32768;
inline constexpr std::uint32_t kTextureLost = 65536;
}  // namespace render_fault

inline constexpr std::array<FaultBit, 9> kRenderFaults = {{
    {render_fault::kNonFinite, "non-finite", "not a finite number",
     "the pose or the force was not a finite number: zero force until cleared",
     "a force or pose was not finite"},
    {render_fault::kStartedInside, "started-inside", "started inside",
     "the stylus was inside an object at the start: no force from that object until the stylus has "
     "left it once"},
    {render_fault::kWalkCapped, "walk-capped", "search cut short",
     "the search for the deepest contact reached its limit of steps: the force may be inexact"},
    {render_fault::kContactsDropped, "contacts-dropped", "too many contacts",
     "more contacts at once than can be computed: some were left out, and the force may be too "
     "small"},
    {render_fault::kContactCapped, "contact-capped", "contact cut short",
     "with several contacts, the search for the ideal tool's position reached its limit of rounds: "
     "the tool stayed where it was"},
    {render_fault::kReleased, "released", "hooked tool released",
     "the tool was hooked behind an object and turned too far: the force faded, and the object "
     "gives no force until the tool has left it"},
    {render_fault::kSoftLate, "soft-late", "soft body late",
     "the next step of a soft object came too late: its surface yielded by its local compliance "
     "alone"},
    {render_fault::kSoftStalled, "soft-stalled", "soft body stalled",
     "no step of a soft object for a tenth of a second: zero force until cleared",
     "the steps of a soft object stopped"},
    {render_fault::kTextureLost, "texture-lost", "texture cut short",
     "the search for the contact's place on a texture reached its limit of steps: the contact "
     "stayed where it was"},
}};

/// Every bit of the table.
inline constexpr std::uint32_t kAllRenderFaults = [] {
  std::uint32_t all = 0;
  for (const FaultBit& fault : kRenderFaults) all |= fault.bit;
  return all;
}();

}  // namespace palpate::rendering
