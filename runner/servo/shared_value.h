#pragma once
// A seqlock: passes values between threads, or between the runner and its watchdog process.

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace palpate::runner::servo {

/// A value written by one thread or process. Others read it whole or not at all: a sequence count
/// is odd during writing (H.-J. Boehm, "Can seqlocks get along with programming language memory
/// models?", 2012, section 4). It contains no address, so it may lie in memory shared by processes.
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
    // Release: a thread that reads a new word also sees the odd count.
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    sequence_.store(before + 2, std::memory_order_release);
  }
  /// False: it is being written.
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

}  // namespace palpate::runner::servo
