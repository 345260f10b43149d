#pragma once
// Passes the newest sample from the servo thread to the session.

#include <array>
#include <atomic>
#include <cstdint>

namespace palpate::runner::servo {

/// Passes the newest value from one thread to another and drops older ones. Neither thread ever
/// waits.
template <class T>
class TripleBuffer {
 public:
  /// Copies a value to all slots, so that members such as vectors allocate here. Call it before
  /// threads share the buffer.
  void fill(const T& value) {
    for (T& slot : slots_) slot = value;
  }
  /// For the writer.
  void write(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
  }
  /// For the reader. False if nothing is newer than the last one read; `value` then stays
  /// unchanged.
  bool read(T& value) noexcept {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    value = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;

  std::array<T, 3> slots_{};
  std::uint8_t back_ = 0, front_ = 1;    ///< the writer's and the reader's own
  std::atomic<std::uint8_t> middle_{2};  ///< the slot between them, and whether it is unread
};

}  // namespace palpate::runner::servo
