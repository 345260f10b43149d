#pragma once
// The fault bits of a servo tick beside the renderer's, and the table of what all of them mean.

#include <algorithm>
#include <array>
#include <cstdint>

#include "rendering/render_fault.h"

namespace palpate::runner {

/// Bits of Sample::faults; the renderer's bits are the low ones.
namespace servo_fault {
inline constexpr std::uint32_t kForceLimited = 16;
inline constexpr std::uint32_t kDeviceLost = 32;
inline constexpr std::uint32_t kMissedTicks = 64;
inline constexpr std::uint32_t kTripped = 128;
inline constexpr std::uint32_t kEmergency = 256;
inline constexpr std::uint32_t kSamplesLost = 512;
inline constexpr std::uint32_t kStalled = 1024;
inline constexpr std::uint32_t kOldReading = 2048;
}  // namespace servo_fault

inline constexpr std::array<rendering::FaultBit, 8> kServoFaults = {{
    {servo_fault::kForceLimited, "force-limited", "force limited",
     "the command was cut in size (6 N, or what the device can) or in change (0.5 N a tick). "
     "Ordinary: where the stylus slips off an edge while it presses, the force falls to zero in "
     "some ticks instead of one"},
    {servo_fault::kDeviceLost, "device-lost", "device lost",
     "the device did not answer: zero force until cleared", "the device was lost"},
    {servo_fault::kMissedTicks, "missed-ticks", "ticks missed",
     "too many ticks in a row came too late: zero force until cleared",
     "too many ticks were missed in a row"},
    {servo_fault::kTripped, "forces-off", "forces off",
     "forces were off, by another fault of this list or of a tick before, until the experimenter "
     "cleared it",
     "they had not been cleared since the last fault"},
    {servo_fault::kEmergency, "emergency", "emergency", "somebody asked for zero force",
     "zero force was asked for"},
    {servo_fault::kSamplesLost, "samples-lost", "samples lost",
     "ticks before this one are not on record; they were rendered"},
    {servo_fault::kStalled, "stalled", "servo stalled", "the servo gave no more samples",
     "the servo gives no more samples"},
    {servo_fault::kOldReading, "old-reading", "old reading",
     "the device's reading was late: the one before was used again"},
}};

/// All bits that a sample or a trial may have, lowest first.
inline constexpr auto kFaultBits = [] {
  std::array<rendering::FaultBit, rendering::kRenderFaults.size() + kServoFaults.size()> all{};
  const auto rest =
      std::copy(rendering::kRenderFaults.begin(), rendering::kRenderFaults.end(), all.begin());
  std::copy(kServoFaults.begin(), kServoFaults.end(), rest);
  return all;
}();
static_assert(std::is_sorted(kFaultBits.begin(), kFaultBits.end(),
                             [](const rendering::FaultBit& a, const rendering::FaultBit& b) {
                               return a.bit < b.bit;
                             }));

constexpr const rendering::FaultBit& fault_bit(std::uint32_t bit) {
  return *std::find_if(kFaultBits.begin(), kFaultBits.end(),
                       [bit](const rendering::FaultBit& fault) { return fault.bit == bit; });
}

}  // namespace palpate::runner
