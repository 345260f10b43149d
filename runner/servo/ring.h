#pragma once
// The queue that carries every sample from the servo thread to the session.

#include <atomic>
#include <bit>
#include <cstddef>
#include <vector>

namespace palpate::runner::servo {

/// A queue of fixed size from one thread to another. Neither thread ever waits.
template <class T>
class Ring {
 public:
  /// Holds at least `size` values; allocates and touches all memory here.
  explicit Ring(std::size_t size) : slots_(std::bit_ceil(size)) {}

  /// For the writer. False: it is full.
  bool push(const T& value) noexcept {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    if (at - read_.load(std::memory_order_acquire) >= slots_.size()) return false;
    slots_[at & (slots_.size() - 1)] = value;
    written_.store(at + 1, std::memory_order_release);
    return true;
  }
  /// For the writer: number of free places.
  std::size_t room() const noexcept {
    return slots_.size() -
           (written_.load(std::memory_order_relaxed) - read_.load(std::memory_order_acquire));
  }
  /// For the reader. False: it is empty.
  bool pop(T& value) noexcept {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    value = slots_[at & (slots_.size() - 1)];
    read_.store(at + 1, std::memory_order_release);
    return true;
  }
  std::size_t capacity() const noexcept { return slots_.size(); }

 private:
  static constexpr std::size_t kLine = 64;  // keeps the two counts in different cache lines

  std::vector<T> slots_;
  alignas(kLine) std::atomic<std::size_t> written_{0};
  alignas(kLine) std::atomic<std::size_t> read_{0};
};

}  // namespace palpate::runner::servo
