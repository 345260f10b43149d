#pragma once
// The watchdog: a small process of its own (the guard) that owns the real device and commands zero
// force if the runner crashes or hangs. It passes readings to the runner and the runner's commands
// to the device; when the runner's calls stop, it sends zero force and goes on sending it.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"

namespace palpate::runner {

// The memory that the runner and its guard process share. No locks: either may die at any point.

/// A DeviceReading in plain numbers.
struct GuardedReading {
  GuardedReading() = default;
  GuardedReading(const DeviceReading& from, std::uint32_t request_, std::uint32_t trips_);
  DeviceReading reading() const;

  std::array<double, 6> tip_and_tail{};  ///< m
  std::uint32_t request = 0;             ///< that it answers
  std::uint32_t trips = 0;               ///< times that the guard has cut the force off
  std::uint8_t buttons = 0;
  bool lost = false;
  DeviceTrouble trouble = DeviceTrouble::none;
};

struct GuardedCommand {
  std::array<double, 3> device1{}, device2{};  ///< N
  std::uint32_t trips_seen = 0;                ///< the runner knows of so many
};

/// Capabilities in fixed room: what a shared memory can hold.
struct FixedCapabilities {
  DeviceCapabilities numbers() const;
  void set(const DeviceCapabilities& from);

  std::array<char, 64> name{};
  std::array<char, 256> serial{}, calibration{};
  int sensed_freedom = 0, actuated_freedom = 0;
  double max_force = 0, max_stiffness = 0, max_rate = 0, workspace_radius = 0, resolution = 0;
  double damping = 0, friction = 0, max_torque = 0;
  bool simulated = false, any_rate = false;
};

enum class GuardState : std::uint32_t { opening, ready, failed, ended };

/// Only lock-free atomics and plain memory: it has no address of its own in either process.
struct GuardChannel {
  // Written by the runner.
  std::atomic<std::uint32_t> calls{0};  ///< futex: moves with each of the four below
  std::atomic<std::uint32_t> reads{0}, commands{0}, zeros{0};
  std::atomic<std::uint32_t> reopens{0};  ///< times that the device was to be opened again
  std::atomic<bool> quit{false};
  SharedValue<GuardedCommand> command;
  // Written by the guard.
  std::atomic<GuardState> state{GuardState::opening};
  std::atomic<std::uint32_t> answered{0};  ///< futex: the last of `reads` that was answered
  SharedValue<GuardedReading> reading;
  std::atomic<std::uint32_t> reopened{0};  ///< the last of `reopens` that is done with
  FixedCapabilities capabilities;          ///< before state becomes ready
  std::array<char, 1024> message{};        ///< before state becomes failed or `reopened` moves

  static_assert(std::atomic<std::uint32_t>::is_always_lock_free &&
                std::atomic<std::uint64_t>::is_always_lock_free &&
                std::atomic<bool>::is_always_lock_free &&
                std::atomic<GuardState>::is_always_lock_free);
};

/// Waits while `word` is `value`, at most so long. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                std::int64_t for_ns) noexcept;
void futex_wake(const std::atomic<std::uint32_t>& word) noexcept;

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

/// Runs the guard in a process that has just been forked; returns when the process is to exit.
/// Forces pass only once a zero command has come from a runner that knows of every time the guard
/// has cut them off, so nothing stale is ever felt. \param runner  process id
void run_guard(GuardChannel& channel, const DeviceFactory& factory, const GuardSettings& settings,
               int runner) noexcept;

}  // namespace palpate::runner
