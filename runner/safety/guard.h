#pragma once
// The watchdog: a small separate process (the guard) that owns the real device and commands zero
// force if the runner crashes or hangs. It passes readings to the runner and the runner's commands
// to the device; when the runner's calls stop, it keeps sending zero force.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"

namespace palpate::runner::safety {

// Memory shared by the runner and its guard process. No locks: either may die at any point.

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

/// Only lock-free atomics and plain memory, without pointers.
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

/// Waits while `word` is `value`, at most `for_ns`. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                std::int64_t for_ns) noexcept;
void futex_wake(const std::atomic<std::uint32_t>& word) noexcept;

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

/// Runs the guard in a newly forked process; returns when the process should exit. Passes forces
/// only after a zero command from a runner that knows of all trips of the guard, so no stale force
/// is ever felt. \param runner  process id
void run_guard(GuardChannel& channel, const DeviceFactory& factory, const GuardSettings& settings,
               int runner) noexcept;

}  // namespace palpate::runner::safety
