#pragma once
// Signal handlers (zero force before any signal ends the program), and the meaning of fault bits.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "rendering/render_fault.h"
#include "runner/safety/guarded_device.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo_thread.h"

namespace palpate::runner::safety {

inline constexpr std::array<rendering::FaultBit, 8> kServoFaults = {{
    {servo::servo_fault::kForceLimited, "force-limited", "force limited",
     "the command was cut in size (6 N, or what the device can) or in change (0.5 N a tick). "
     "Ordinary: where the stylus slips off an edge while it presses, the force falls to zero in "
     "some ticks instead of one"},
    {servo::servo_fault::kDeviceLost, "device-lost", "device lost",
     "the device did not answer: zero force until cleared", "the device was lost"},
    {servo::servo_fault::kMissedTicks, "missed-ticks", "ticks missed",
     "too many ticks in a row came too late: zero force until cleared, where the device has motors",
     "too many ticks were missed in a row"},
    {servo::servo_fault::kTripped, "forces-off", "forces off",
     "forces were off, by another fault of this list or of an earlier tick, until the experimenter "
     "cleared it",
     "they have not been cleared since the last fault"},
    {servo::servo_fault::kEmergency, "emergency", "emergency",
     "zero force was asked for (emergency key or button, or a signal): zero force until cleared",
     "zero force was asked for"},
    {servo::servo_fault::kSamplesLost, "samples-lost", "samples lost",
     "the ticks before this one were rendered, but are not on record"},
    {servo::servo_fault::kStalled, "stalled", "servo stalled",
     "the servo gave no more samples: zero force until cleared", "the servo gives no more samples"},
    {servo::servo_fault::kOldReading, "old-reading", "old reading",
     "the device's reading was late: the one before was used again"},
}};

/// The meaning of every fault bit of a sample or a trial, lowest first: the one table for the
/// console, a session's messages and the codebook of exports.
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

/// \param bit  a bit of the table
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

/// While it lives, SIGINT, SIGTERM and SIGHUP command zero force and ask the session to end (a
/// second one ends the program as usual). SIGABRT (failed assertion, uncaught exception), SIGSEGV,
/// SIGBUS, SIGFPE and SIGILL command zero force, wait until it is sent, and end the program as
/// usual. Only one may exist at a time; create and destroy it in one thread.
class FaultSignals {
 public:
  FaultSignals();
  ~FaultSignals();
  FaultSignals(const FaultSignals&) = delete;
  FaultSignals& operator=(const FaultSignals&) = delete;

  /// Sets the servo or guard to command; null: none. It must outlive its use here.
  void watch(servo::ServoThread* servo) noexcept { servo_.store(servo); }
  void watch(GuardedDevice* guard) noexcept { guard_.store(guard); }
  /// The signal that requested the end; 0: none.
  int end_requested() const noexcept { return end_requested_.load(); }

 private:
  static void asked_to_end(int signal);
  static void dying(int signal);
  void zero_force() noexcept;

  std::atomic<servo::ServoThread*> servo_{nullptr};
  std::atomic<GuardedDevice*> guard_{nullptr};
  std::atomic<int> end_requested_{0};
};

}  // namespace palpate::runner::safety
