#pragma once
// The fault bits of a renderer, and the one table that says what they mean: names in files, words
// on screens and codebooks are made from it.

#include <array>
#include <cstdint>

namespace palpate::rendering {

/// What a fault bit is called and what it means.
struct FaultBit {
  std::uint32_t bit;
  const char* name;      ///< in files
  const char* words;     ///< on a screen
  const char* meaning;   ///< in a codebook
  const char* why = "";  ///< why forces went off, in a sentence; "" where they do not
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
}  // namespace render_fault

inline constexpr std::array<FaultBit, 8> kRenderFaults = {{
    {render_fault::kNonFinite, "non-finite", "not a finite number",
     "the pose or the force was not a finite number: zero force until cleared",
     "a force or pose was not finite"},
    {render_fault::kStartedInside, "started-inside", "started inside",
     "the stylus was inside an object at first: no force from it until it has been left once"},
    {render_fault::kWalkCapped, "walk-capped", "search cut short",
     "the search for the deepest contact met its limit of steps: the force may not be the last"},
    {render_fault::kContactsDropped, "contacts-dropped", "too many contacts",
     "more objects were touched at once than are rendered: the force is too small"},
    {render_fault::kContactCapped, "contact-capped", "contact cut short",
     "the search for where several contacts let the ideal tool be met its limit of rounds: it "
     "stayed "
     "where it was"},
    {render_fault::kReleased, "released", "hooked tool released",
     "the tool hooked behind an object and turned too far from it: its force faded, and there is "
     "none "
     "from that object until it has been left"},
    {render_fault::kSoftLate, "soft-late", "soft body late",
     "the next step of a soft object was not there in time: its surface gave way by its local "
     "compliance alone"},
    {render_fault::kSoftStalled, "soft-stalled", "soft body stalled",
     "the steps of a soft object had not come for a tenth of a second: zero force until cleared",
     "a soft object was not stepped any more"},
}};

/// Every bit of the table.
inline constexpr std::uint32_t kAllRenderFaults = [] {
  std::uint32_t all = 0;
  for (const FaultBit& fault : kRenderFaults) all |= fault.bit;
  return all;
}();

}  // namespace palpate::rendering
