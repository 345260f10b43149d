#pragma once
// When a silent servo counts as stalled.

#include <chrono>

namespace palpate::runner::servo {

/// The time until a silent servo counts as stalled: one second with motors. Without motors zero
/// force is not urgent, so it is ten seconds, and time in which the whole program stood still does
/// not count.
class Patience {
 public:
  explicit Patience(bool has_motors) noexcept : has_motors_(has_motors) { begin(); }
  /// Restarts the time: a sample has arrived.
  void begin() noexcept;
  /// Call it every few milliseconds.
  bool is_over() noexcept;

 private:
  using Time = std::chrono::steady_clock::time_point;
  bool has_motors_;
  Time heard_, asked_;
  std::chrono::nanoseconds waited_{0};  ///< only while the program ran
};

}  // namespace palpate::runner::servo
