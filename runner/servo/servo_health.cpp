#include "runner/servo/servo_health.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate::runner::servo {
namespace {

// Only one thread writes, so a load and a store suffice, without a locked increment.
template <class T>
void increase(std::atomic<T>& value, T by) noexcept {
  value.store(value.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

}  // namespace

int TimeHistogram::bin(std::int64_t ns) noexcept {
  if (ns < kSteps) return static_cast<int>(std::max<std::int64_t>(ns, 0));
  // The leading bit gives the doubling, the next three the step in it.
  const int shift = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(ns))) - 4;
  return std::min(kBins - 1, shift * kSteps + static_cast<int>(ns >> shift));
}

std::int64_t TimeHistogram::upper_edge(int bin) noexcept {
  if (bin < 2 * kSteps) return bin;
  const int shift = bin / kSteps - 1;
  return (static_cast<std::int64_t>(bin - shift * kSteps + 1) << shift) - 1;
}

void TimeHistogram::add(std::int64_t ns) noexcept {
  increase<std::uint64_t>(bins_[static_cast<std::size_t>(bin(ns))], 1);
  increase<std::uint64_t>(count_, 1);
  if (ns > longest()) longest_.store(ns, std::memory_order_relaxed);
}

std::int64_t TimeHistogram::quantile(double p) const noexcept {
  const double wanted = p * static_cast<double>(count());
  double so_far = 0;
  for (int i = 0; i < kBins; ++i) {
    so_far +=
        static_cast<double>(bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed));
    if (so_far > 0 && so_far >= wanted) return std::min(upper_edge(i), longest());
  }
  return longest();
}

double TimeHistogram::fraction_above(std::int64_t ns) const noexcept {
  std::uint64_t above = 0;
  for (int i = bin(ns) + 1; i < kBins; ++i)
    above += bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
  return count() > 0 ? static_cast<double>(above) / static_cast<double>(count()) : 0;
}

std::vector<std::pair<std::int64_t, std::uint64_t>> TimeHistogram::steps() const {
  std::vector<std::pair<std::int64_t, std::uint64_t>> out;
  for (int i = 0; i < kBins; ++i) {
    const std::uint64_t in_step =
        bins_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
    if (in_step > 0) out.emplace_back(upper_edge(i), in_step);
  }
  return out;
}

void ServoHealth::add(const Sample& sample, std::int64_t period_ns) noexcept {
  lateness_.add(sample.lateness_ns);
  compute_.add(sample.compute_ns);
  if (counted_.ticks++ == 0) first_due_ns_ = sample.time_ns - sample.lateness_ns;
  // A clock that stands still or steps back makes a tick early: none was missed.
  counted_.missed_ticks +=
      static_cast<std::uint64_t>(std::max<std::int64_t>(sample.lateness_ns, 0) / period_ns);
  counted_.elapsed_ns = sample.time_ns - first_due_ns_;
  time_kept_.write(counted_);
  faults_.store(faults() | sample.faults, std::memory_order_relaxed);
  if (sample.period_ns > longest_period_ns())
    longest_period_.store(sample.period_ns, std::memory_order_relaxed);
}

TimeKept ServoHealth::time_kept() const noexcept {
  TimeKept kept;
  while (!time_kept_.read(kept)) {
  }
  return kept;
}

void ServoHealth::add_lost_sample() noexcept {
  increase<std::uint64_t>(lost_, 1);
  faults_.store(faults() | servo_fault::kSamplesLost, std::memory_order_relaxed);
}

std::string to_json_text(const ServoHealth& health, double rate) {
  const auto times = [](const TimeHistogram& histogram) {
    return nlohmann::ordered_json{{"median", histogram.quantile(0.5)},
                                  {"p99", histogram.quantile(0.99)},
                                  {"p99.9", histogram.quantile(0.999)},
                                  {"max", histogram.longest()},
                                  {"up_to_and_count", histogram.steps()}};
  };
  const auto period_ns = static_cast<std::int64_t>(1e9 / rate);
  const TimeKept kept = health.time_kept();
  const nlohmann::ordered_json json{
      {"servo",
       {{"rate_hz", rate},
        {"ticks", kept.ticks},
        {"missed_ticks", kept.missed_ticks},
        {"elapsed_ns", kept.elapsed_ns},
        {"late_by_a_period_share", health.lateness().fraction_above(period_ns)},
        {"lost_samples", health.lost_samples()},
        {"faults", health.faults()},
        {"longest_period_ns", health.longest_period_ns()},
        {"lateness_ns", times(health.lateness())},
        {"compute_ns", times(health.compute())}}}};
  return json.dump();
}

}  // namespace palpate::runner::servo
