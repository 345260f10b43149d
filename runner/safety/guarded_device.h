#pragma once
// The runner's interface to a device behind the watchdog: reads and writes go through the guard
// process, which survives a crash of the runner.

#include <cstdint>
#include <string>

#include "runner/safety/guard.h"
#include "runner/safety/shared_memory.h"
#include "runner/servo/device.h"

namespace palpate::runner::safety {

/// The runner's side of the watchdog. If a reading takes longer than half a period, the last one is
/// repeated (DeviceTrouble::late). After many such readings in a row the device counts as lost
/// (guard_late) until readings arrive again. A guard that has ended, or hangs longer than a busy
/// machine explains, is lost for good (guard_lost).
class GuardedDevice final : public servo::Device {
 public:
  /// Forks: call it before creating other threads. `factory` runs in the guard. Returns once the
  /// device has been read for the first time, even if that reading reports trouble.
  /// \throws std::runtime_error with the factory's message, or why there is no guard
  GuardedDevice(const DeviceFactory& factory, const GuardSettings& settings);
  /// Commands zero force, closes the device and ends the guard.
  ~GuardedDevice() override;
  GuardedDevice(const GuardedDevice&) = delete;
  GuardedDevice& operator=(const GuardedDevice&) = delete;

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  /// Makes the guard itself command zero force, whatever the servo does. From any thread or signal
  /// handler.
  void emergency_zero() noexcept;

  /// Makes the guard open the device again (Device::reopen). Returns at once; readings are lost
  /// until it is done. Call it from one thread, which may differ from that of read and write.
  void ask_to_reopen() noexcept;
  bool reopening() const noexcept;
  /// The obstacle to the last reopening; empty: none. For the thread that asked, after it is done.
  std::string reopen_trouble() const;

  int guard_process() const { return guard_; }

 private:
  bool ended() noexcept;
  servo::DeviceTrouble without_answer() noexcept;
  void end() noexcept;

  SharedMemory<GuardChannel> channel_;
  const GuardSettings settings_;
  int guard_ = -1;
  bool ended_ = false;
  servo::DeviceCapabilities capabilities_;
  servo::DeviceReading last_;
  std::uint32_t trips_seen_ = 0;
  int unanswered_ = 0;            ///< reads in a row
  std::int64_t answered_ns_ = 0;  ///< time of the last answer
};

}  // namespace palpate::runner::safety
