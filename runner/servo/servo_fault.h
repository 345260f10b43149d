#pragma once
// The fault bits of a servo tick beside the renderer's (rendering/render_fault.h). A bit that is
// added here needs a row in runner/safety/fault_table.h, which says what it means; a test looks.

#include <cstdint>

#include "rendering/render_fault.h"

namespace palpate::runner::servo_fault {

// Bits of Sample::faults; the renderer's are 1 to 8 and 4096 on.
inline constexpr std::uint32_t kForceLimited = 16;
inline constexpr std::uint32_t kDeviceLost = 32;
inline constexpr std::uint32_t kMissedTicks = 64;
inline constexpr std::uint32_t kTripped = 128;
inline constexpr std::uint32_t kEmergency = 256;
inline constexpr std::uint32_t kSamplesLost = 512;
inline constexpr std::uint32_t kStalled = 1024;
inline constexpr std::uint32_t kOldReading = 2048;

}  // namespace palpate::runner::servo_fault
