#pragma once
// What every fault bit of a sample means: the one table that the console, the messages of a session
// and the codebook of the exports are made from.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "rendering/render_fault.h"
#include "runner/servo/servo_fault.h"

namespace palpate::runner {

inline constexpr std::array<rendering::FaultBit, 8> kServoFaults = {{
    {servo_fault::kForceLimited, "force-limited", "force limited",
     "the command was cut in size (6 N, or what the device can) or in change (0.5 N a tick). "
     "Ordinary: where the stylus slips off an edge while it presses, the force falls to zero in "
     "some ticks instead of one"},
    {servo_fault::kDeviceLost, "device-lost", "device lost",
     "the device did not answer: zero force until cleared", "the device was lost"},
    {servo_fault::kMissedTicks, "missed-ticks", "ticks missed",
     "too many ticks in a row came too late: zero force until cleared, where the device has motors",
     "too many ticks were missed in a row"},
    {servo_fault::kTripped, "forces-off", "forces off",
     "forces were off, by another fault of this list or of an earlier tick, until the experimenter "
     "cleared it",
     "they have not been cleared since the last fault"},
    {servo_fault::kEmergency, "emergency", "emergency",
     "zero force was asked for (emergency key or button, or a signal): zero force until cleared",
     "zero force was asked for"},
    {servo_fault::kSamplesLost, "samples-lost", "samples lost",
     "the ticks before this one were rendered, but are not on record"},
    {servo_fault::kStalled, "stalled", "servo stalled",
     "the servo gave no more samples: zero force until cleared", "the servo gives no more samples"},
    {servo_fault::kOldReading, "old-reading", "old reading",
     "the device's reading was late: the one before was used again"},
}};

/// All bits that a sample or a trial may have, lowest first.
inline constexpr auto kFaultTable = [] {
  std::array<rendering::FaultBit, rendering::kRenderFaults.size() + kServoFaults.size()> all{};
  const auto rest =
      std::copy(rendering::kRenderFaults.begin(), rendering::kRenderFaults.end(), all.begin());
  std::copy(kServoFaults.begin(), kServoFaults.end(), rest);
  std::sort(all.begin(), all.end(), [](const rendering::FaultBit& a, const rendering::FaultBit& b) {
    return a.bit < b.bit;
  });
  return all;
}();
static_assert(std::is_sorted(kFaultTable.begin(), kFaultTable.end(),
                             [](const rendering::FaultBit& a, const rendering::FaultBit& b) {
                               return a.bit < b.bit;
                             }));

/// \param bit  one that is in the table
constexpr const rendering::FaultBit& fault_row(std::uint32_t bit) {
  return *std::find_if(kFaultTable.begin(), kFaultTable.end(),
                       [bit](const rendering::FaultBit& fault) { return fault.bit == bit; });
}

/// The bits as the console shows them, "device lost, forces off"; empty for none.
inline std::string fault_words(std::uint32_t faults) {
  std::string out;
  for (const rendering::FaultBit& fault : kFaultTable) {
    if ((faults & fault.bit) == 0) continue;
    if (!out.empty()) out += ", ";
    out += fault.words;
    faults &= ~fault.bit;
  }
  if (faults != 0)
    out += (out.empty() ? "unknown (" : ", unknown (") + std::to_string(faults) + ')';
  return out;
}

}  // namespace palpate::runner
