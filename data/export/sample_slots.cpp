#include "data/export/sample_slots.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace palpate::data {
namespace {

constexpr std::int64_t kLongestLoss = 600'000;  // slots: ten minutes at 1 kHz
constexpr double kLongestTrial = 1e6;           // s

/// Damaged times may differ by more than 63 bits.
double elapsed_seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return (static_cast<double>(to_ns) - static_cast<double>(from_ns)) / 1e9;
}

}  // namespace

double duration_of(const TrialRecord& record) {
  return record.response_time + elapsed_seconds(first_onset_ns(record), record.onset_ns);
}

/// -1: no interval is left
std::int64_t SampleSlots::begin_of_next_interval() {
  const std::vector<IntervalRecord> all = intervals_of(trial_.record);
  for (std::size_t i = static_cast<std::size_t>(interval_) + 1; i < all.size(); ++i) {
    if (all[i].onset_ns == 0) continue;  // never shown
    interval_ = static_cast<int>(i);
    const double since = elapsed_seconds(first_onset_ns(trial_.record), all[i].onset_ns);
    return static_cast<std::int64_t>(std::round(std::clamp(since, 0.0, kLongestTrial) * rate_));
  }
  return -1;
}

std::int64_t SampleSlots::next() {
  const auto& samples = trial_.record.samples;
  const SampleRecord& sample = samples[index_];
  if (index_++ == 0) return slot_ = sample.tick;
  const SampleRecord& before = samples[index_ - 2];
  if (sample.tick <= before.tick) {
    // An interval that begins when the previous one ends (an adjustment continues) takes the next
    // slot; each of these may have delayed the later ones by one slot.
    const std::int64_t begin = begin_of_next_interval();
    if (begin >= 0 && begin + interval_ > slot_)
      return slot_ = std::max(begin + sample.tick, slot_ + 1);
  }
  double step = static_cast<double>(sample.tick) - static_cast<double>(before.tick);
  if (step == 1 && sample.period_ns > 0) {
    // After a late tick, the slots until the next scheduled one are empty.
    const double due_ns = static_cast<double>(sample.period_ns) -
                          static_cast<double>(sample.lateness_ns) +
                          static_cast<double>(before.lateness_ns);
    step = std::max(1.0, std::round(due_ns * rate_ / 1e9));
  }
  if (!(step >= 1 && step <= kLongestLoss)) {
    throw StoreRefused(
        "participant " + trial_.participant.code + ", session " +
        std::to_string(trial_.record.session) + ", trial " + std::to_string(trial_.record.trial) +
        ": the samples are damaged: tick " + std::to_string(sample.tick) + " follows tick " +
        std::to_string(before.tick) + " after " + std::to_string(sample.period_ns) + " ns");
  }
  return slot_ += static_cast<std::int64_t>(step);
}

}  // namespace palpate::data
