#pragma once
// Times ticks one by one. Of runner/bench alone.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/renderer.h"
#include "runner/bench/allocation_count.h"
#include "runner/bench/tick_cost.h"
#include "runner/servo/tick_clock.h"

namespace palpate::runner {

class TickTimer {
 public:
  static constexpr double kTick = 1e-3;  ///< s

  TickTimer() : ns_(nanoseconds_per_count()) {
    std::vector<std::uint64_t> empty(100'000);
    for (auto& count : empty) {
      const std::uint64_t start = begin_count();
      count = end_count() - start;
    }
    empty_ns_ = at(empty, 0.5);
  }

  /// Runs one tick; its time is recorded if its state of contact is the wanted one.
  rendering::Rendering tick(const rendering::Renderer& renderer, const rendering::Scene& scene,
                            rendering::RenderState& state, const rendering::LineProbe& probe,
                            bool touching_wanted) {
    const std::uint64_t allocated = allocations();
    const std::uint64_t start = begin_count();
    rendering::Rendering rendering = renderer.tick(scene, state, probe, kTick);
    const std::uint64_t count = end_count() - start;
    allocations_ += allocations() - allocated;
    if ((rendering.contacts > 0) == touching_wanted) counts_.push_back(count);
    return rendering;
  }

  std::size_t ticks() const { return counts_.size(); }

  /// The statistics of the row; starts a new one.
  TickCost take() {
    TickCost cost;
    cost.ticks = counts_.size();
    if (!counts_.empty()) {
      cost.median_ns = at(counts_, 0.5);
      cost.p99_ns = at(counts_, 0.99);
      cost.max_ns = at(counts_, 1);
    }
    cost.allocations = allocations_;
    cost.empty_loop_ns = empty_ns_;
    counts_.clear();
    allocations_ = 0;
    return cost;
  }

 private:
  double at(std::vector<std::uint64_t>& counts, double quantile) const {
    const auto k = static_cast<std::ptrdiff_t>(quantile * static_cast<double>(counts.size() - 1));
    std::nth_element(counts.begin(), counts.begin() + k, counts.end());
    return static_cast<double>(counts[static_cast<std::size_t>(k)]) * ns_;
  }

  double ns_, empty_ns_ = 0;
  std::vector<std::uint64_t> counts_;
  std::size_t allocations_ = 0;
};

/// One row from kTickRounds rounds of the same ticks, `measure()` each: other programs and the
/// machine only add to a round, so the lowest median and 99th percentile are kept. The maximum is
/// that of all rounds.
template <class Measure>
TickCost least_disturbed(const Measure& measure) {
  TickCost row = measure();
  row.p99_highest_ns = row.p99_ns;
  for (int round = 1; round < kTickRounds; ++round) {
    const TickCost next = measure();
    row.ticks += next.ticks;
    row.allocations += next.allocations;
    row.median_ns = std::min(row.median_ns, next.median_ns);
    row.p99_ns = std::min(row.p99_ns, next.p99_ns);
    row.p99_highest_ns = std::max(row.p99_highest_ns, next.p99_ns);
    row.max_ns = std::max(row.max_ns, next.max_ns);
  }
  return row;
}

}  // namespace palpate::runner
