#pragma once
// The memory that the runner and its guard process share. No locks: either may die at any point.

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "runner/device.h"

namespace palpate {

/// A value that one process writes and another reads whole, or not at all: a sequence count that is
/// odd while it is being written (H.-J. Boehm, "Can seqlocks get along with programming language
/// memory models?", 2012, section 4).
template <class T>
class SharedValue {
  static_assert(std::is_trivially_copyable_v<T>);
  static constexpr std::size_t kWords = (sizeof(T) + 7) / 8;

 public:
  void write(const T& value) noexcept {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof(T));
    const std::uint32_t before = sequence_.load(std::memory_order_relaxed);
    sequence_.store(before + 1, std::memory_order_relaxed);
    // Released: who reads a new word also sees that the count is odd.
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    sequence_.store(before + 2, std::memory_order_release);
  }
  /// False while it is being written.
  bool read(T& value) const noexcept {
    const std::uint32_t before = sequence_.load(std::memory_order_acquire);
    std::array<std::uint64_t, kWords> words{};
    for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_acquire);
    if ((before & 1) != 0 || sequence_.load(std::memory_order_relaxed) != before) return false;
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
    return true;
  }

 private:
  std::atomic<std::uint32_t> sequence_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

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
  double damping = 0, friction = 0;
  bool simulated = false;
};

enum class GuardState : std::uint32_t { opening, ready, failed, ended };

/// Only lock-free atomics and plain memory: it has no address of its own in either process.
struct GuardChannel {
  // Written by the runner.
  std::atomic<std::uint32_t> calls{0};  ///< futex: moves with each of the three below
  std::atomic<std::uint32_t> reads{0}, commands{0}, zeros{0};
  std::atomic<bool> quit{false};
  SharedValue<GuardedCommand> command;
  // Written by the guard.
  std::atomic<GuardState> state{GuardState::opening};
  std::atomic<std::uint32_t> answered{0};  ///< futex: the last of `reads` that was answered
  SharedValue<GuardedReading> reading;
  FixedCapabilities capabilities;    ///< before state becomes ready
  std::array<char, 1024> message{};  ///< before state becomes failed

  static_assert(std::atomic<std::uint32_t>::is_always_lock_free &&
                std::atomic<std::uint64_t>::is_always_lock_free &&
                std::atomic<bool>::is_always_lock_free &&
                std::atomic<GuardState>::is_always_lock_free);
};

/// Waits while `word` is `value`, at most so long. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                std::int64_t for_ns) noexcept;
void futex_wake(const std::atomic<std::uint32_t>& word) noexcept;

}  // namespace palpate
