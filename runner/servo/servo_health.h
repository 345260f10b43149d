#pragma once
// Timing statistics of the servo loop over every tick: lateness, computing time, missed ticks.

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "runner/servo/sample.h"
#include "runner/servo/shared_value.h"

namespace palpate::runner::servo {

/// A histogram of times in steps of 1/8 of their size (12.5 % wide at most; exact below 16 ns),
/// from 0 to hours. One thread adds; any may read at the same time.
class TimeHistogram {
 public:
  void add(std::int64_t ns) noexcept;
  std::uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
  std::int64_t longest() const noexcept { return longest_.load(std::memory_order_relaxed); }
  /// The `p` quantile, as the upper edge of its step, ns.
  std::int64_t quantile(double p) const noexcept;
  /// Share of counts in steps above `ns`.
  double fraction_above(std::int64_t ns) const noexcept;
  /// The steps that are not empty, as upper edge (ns) and count, in order.
  std::vector<std::pair<std::int64_t, std::uint64_t>> steps() const;

 private:
  static constexpr int kSteps = 8;   ///< number of steps in each doubling
  static constexpr int kBins = 352;  ///< up to 2^45 ns
  static int bin(std::int64_t ns) noexcept;
  static std::int64_t upper_edge(int bin) noexcept;

  std::array<std::atomic<std::uint64_t>, kBins> bins_{};
  std::atomic<std::uint64_t> count_{0};
  std::atomic<std::int64_t> longest_{0};
};

/// Ticks against the clock: elapsed_ns / period = ticks - 1 + missed_ticks, all whole numbers.
struct TimeKept {
  std::uint64_t ticks = 0;
  std::uint64_t missed_ticks = 0;  ///< whole periods that passed without a tick
  /// By the clock, from the due time of the first tick to the start of the last one.
  std::int64_t elapsed_ns = 0;
};

/// Timing statistics of all ticks of a servo thread.
class ServoHealth {
 public:
  /// Call it in the servo's thread.
  void add(const Sample& sample, std::int64_t period_ns) noexcept;
  void add_lost_sample() noexcept;

  /// All three values at the same moment.
  TimeKept time_kept() const noexcept;
  std::uint64_t ticks() const noexcept { return lateness_.count(); }
  std::uint64_t missed_ticks() const noexcept { return time_kept().missed_ticks; }
  std::uint64_t lost_samples() const noexcept { return lost_.load(std::memory_order_relaxed); }
  std::uint32_t faults() const noexcept { return faults_.load(std::memory_order_relaxed); }
  std::int64_t longest_period_ns() const noexcept {
    return longest_period_.load(std::memory_order_relaxed);
  }
  const TimeHistogram& lateness() const { return lateness_; }
  const TimeHistogram& compute() const { return compute_; }

 private:
  TimeHistogram lateness_, compute_;
  TimeKept counted_;               ///< the servo's own
  std::int64_t first_due_ns_ = 0;  ///< likewise
  SharedValue<TimeKept> time_kept_;
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<std::uint32_t> faults_{0};
  std::atomic<std::int64_t> longest_period_{0};
};

/// JSON for a session's record: counts, quantiles, and the histograms of all ticks' lateness and
/// computing time.
std::string to_json_text(const ServoHealth& health, double rate);

}  // namespace palpate::runner::servo
