#pragma once
// Cost of one tick: its time by a fast clock, and its heap allocations.

#include <chrono>
#include <cstdint>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace palpate::runner::evidence {

/// Counts of a fast clock. On x86 the time stamp counter: reading it costs some 10 ns.
inline std::uint64_t begin_count() {
#if defined(__x86_64__)
  _mm_lfence();  // earlier work, such as computing the pose, must not be counted
  const std::uint64_t count = __rdtsc();
  _mm_lfence();
  return count;
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

inline std::uint64_t end_count() {
#if defined(__x86_64__)
  unsigned core;
  return __rdtscp(&core);
#else
  return begin_count();
#endif
}

/// Measures it; takes a tenth of a second.
inline double nanoseconds_per_count() {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t count = begin_count();
  while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(100)) {
  }
  const auto counts = static_cast<double>(end_count() - count);
  const std::chrono::duration<double, std::nano> passed = std::chrono::steady_clock::now() - start;
  return passed.count() / counts;
}

/// Heap allocations of this thread so far, counted by a replaced operator new. Always 0 under
/// sanitizers, which have their own operator new.
std::uint64_t allocations();

/// Whether allocations() counts.
bool counts_allocations();

}  // namespace palpate::runner::evidence
