#pragma once
// A device behind the watchdog, as the runner sees it: reads and writes go through the guard
// process, which outlives whatever happens to the runner.

#include <cstdint>
#include <memory>
#include <string>

#include "runner/safety/guard.h"
#include "runner/servo/device.h"

namespace palpate::runner {

/// The runner's side of the watchdog. A reading that does not come within half a period is the last
/// one again (DeviceTrouble::late). So many in a row are a lost device (guard_late) until readings
/// come again; a guard that has ended, or has hung for longer than any busy machine keeps it, is
/// one for good.
class GuardedDevice final : public Device {
 public:
  /// Forks: call it before there are other threads. `factory` runs in the guard. Returns once the
  /// device has been read for the first time, whatever that reading says.
  /// \throws std::runtime_error with what the factory threw, or why there is no guard
  GuardedDevice(const DeviceFactory& factory, const GuardSettings& settings);
  /// Zero force; the device is closed and the guard ends.
  ~GuardedDevice() override;
  GuardedDevice(const GuardedDevice&) = delete;
  GuardedDevice& operator=(const GuardedDevice&) = delete;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  /// Zero force by the guard itself, whatever the servo does. From any thread or signal handler.
  void emergency_zero() noexcept;

  /// Has the guard open the device again (Device::reopen). Returns at once; readings are lost until
  /// it is done. From one thread, which may be another than that of read and write.
  void ask_to_reopen() noexcept;
  bool reopening() const noexcept;
  /// What was in the way the last time; empty: nothing. By the thread that asked, once it is done.
  std::string reopen_trouble() const;

  int guard_process() const { return guard_; }

 private:
  struct Unmap {
    void operator()(GuardChannel* channel) const;
  };

  bool ended() noexcept;
  DeviceTrouble without_answer() noexcept;
  void end() noexcept;

  std::unique_ptr<GuardChannel, Unmap> channel_;
  const GuardSettings settings_;
  int guard_ = -1;
  bool ended_ = false;
  DeviceCapabilities capabilities_;
  DeviceReading last_;
  std::uint32_t trips_seen_ = 0;
  int unanswered_ = 0;            ///< reads in a row
  std::int64_t answered_ns_ = 0;  ///< when one was answered last
};

}  // namespace palpate::runner
