#pragma once
// The runner's interface to a device behind the watchdog: a small separate process (the guard) that
// owns the real device and commands zero force if the runner crashes or hangs. It passes readings
// to the runner and the runner's commands to the device; when the runner's calls stop, it keeps
// sending zero force.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "runner/safety/shared_memory.h"
#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"

namespace palpate::runner::safety {

/// A DeviceReading in plain numbers.
struct GuardedReading {
  GuardedReading() = default;
  GuardedReading(const servo::DeviceReading& from, std::uint32_t request_, std::uint32_t trips_);
  servo::DeviceReading reading() const;

  std::array<double, 6> tip_and_tail{};  ///< m
  std::uint32_t request = 0;             ///< number of the request that it answers
  std::uint32_t trips = 0;               ///< number of times that the guard has cut off forces
  std::uint8_t buttons = 0;
  bool lost = false;
  servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
};

struct GuardedCommand {
  std::array<double, 3> device1{}, device2{};  ///< N
  std::uint32_t trips_seen = 0;                ///< number of trips known to the runner
};

/// Capabilities of fixed size, for shared memory.
struct FixedCapabilities {
  servo::DeviceCapabilities numbers() const;
  void set(const servo::DeviceCapabilities& from);

  std::array<char, 64> name{};
  std::array<char, 256> serial{}, calibration{};
  int sensed_freedom = 0, actuated_freedom = 0;
  double max_force = 0, max_stiffness = 0, max_rate = 0, workspace_radius = 0, resolution = 0;
  double damping = 0, friction = 0, max_torque = 0;
  bool simulated = false, any_rate = false;
};

enum class GuardState : std::uint32_t { opening, ready, failed, ended };

/// Memory shared by the runner and its guard process. No locks: either may die at any point. Only
/// lock-free atomics and plain memory, without pointers.
struct GuardChannel {
  // Written by the runner.
  std::atomic<std::uint32_t> calls{0};  ///< futex: increases with each of the four below
  std::atomic<std::uint32_t> reads{0}, commands{0}, zeros{0};
  std::atomic<std::uint32_t> reopens{0};  ///< number of requests to open the device again
  std::atomic<bool> quit{false};
  servo::SharedValue<GuardedCommand> command;
  // Written by the guard.
  std::atomic<GuardState> state{GuardState::opening};
  std::atomic<std::uint32_t> answered{0};  ///< futex: the last answered of `reads`
  servo::SharedValue<GuardedReading> reading;
  std::atomic<std::uint32_t> reopened{0};  ///< the last finished of `reopens`
  FixedCapabilities capabilities;          ///< written before state becomes ready
  std::array<char, 1024> message{};        ///< written before state failed or `reopened`

  static_assert(std::atomic<std::uint32_t>::is_always_lock_free &&
                std::atomic<std::uint64_t>::is_always_lock_free &&
                std::atomic<bool>::is_always_lock_free &&
                std::atomic<GuardState>::is_always_lock_free);
};

struct GuardSettings {
  double rate = 1000;  ///< Hz, of the servo
  /// s; zero force after this time without a call of the runner (or after 5 periods if longer)
  double silence = 0.005;
  double linger = 1;      ///< s; time of sending zero force after the runner has died
  double patience = 120;  ///< s; limit for opening the device: firmware may have to be uploaded
  double given_up = 30;   ///< s; a guard silent for longer counts as ended
  int priority = 85;      ///< of SCHED_FIFO, if allowed; above the servo's. 0: do not ask
};

using DeviceFactory = std::function<std::unique_ptr<servo::Device>()>;

/// The runner's side of the watchdog. If a reading takes longer than half a period, the last one is
/// repeated (DeviceTrouble::late). After many such readings in a row the device counts as lost
/// (guard_late) until readings arrive again. A guard that has ended, or hangs longer than a busy
/// machine explains, is lost for good (guard_lost) and killed. One that was stopped (SIGSTOP) sends
/// zero force and ends.
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
  void end_stopped() noexcept;
  servo::DeviceTrouble without_answer() noexcept;
  void end() noexcept;

  SharedMemory<GuardChannel> channel_;
  const GuardSettings settings_;
  int guard_ = -1;
  bool ended_ = false, stopped_ = false;
  servo::DeviceCapabilities capabilities_;
  servo::DeviceReading last_;
  std::uint32_t trips_seen_ = 0;
  int unanswered_ = 0;            ///< reads in a row
  std::int64_t answered_ns_ = 0;  ///< time of the last answer
};

}  // namespace palpate::runner::safety
