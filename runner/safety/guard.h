#pragma once
// The guard: a small process that owns the real device. What dies with the runner cannot guard the
// hand; this does. It passes readings and commands on, and when the runner's calls stop, whether it
// died, hangs or was stopped, it sends zero force and goes on doing so.

#include <functional>
#include <memory>

#include "runner/safety/guard_channel.h"
#include "runner/servo/device.h"

namespace palpate::runner {

struct GuardSettings {
  double rate = 1000;  ///< Hz, of the servo
  /// s; without a call of the runner's for so long, or for 5 periods where that is more: zero force
  double silence = 0.005;
  double linger = 1;      ///< s; zero force is sent for so long after the runner has died
  double patience = 120;  ///< s; for the device to be opened: firmware may have to be uploaded
  double given_up = 30;   ///< s; a guard that has been silent for so long counts as ended
  int priority = 85;      ///< of SCHED_FIFO, where allowed; above the servo's. 0: do not ask
};

using DeviceFactory = std::function<std::unique_ptr<Device>()>;

/// The guard's whole life, in a process that has just been forked; returns when it is to exit.
/// Forces pass only once a zero command has come from a runner that knows of every time the guard
/// has cut them off, so nothing stale is ever felt. \param runner  process id
void run_guard(GuardChannel& channel, const DeviceFactory& factory, const GuardSettings& settings,
               int runner) noexcept;

/// The runner's side. A reading that does not come within half a period is the last one again
/// (DeviceTrouble::late). So many in a row are a lost device (guard_late) until readings come
/// again; a guard that has ended, or has hung for longer than any busy machine keeps it, is one for
/// good.
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
