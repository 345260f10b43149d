#include "data/export/sample_slots.h"

#include <cmath>
#include <string>

namespace palpate::data {
namespace {

constexpr std::int64_t kLongestLoss = 600'000;  // slots: ten minutes at 1 kHz

}  // namespace

std::int64_t SampleSlots::next() {
  const auto& samples = trial_.record.samples;
  const SampleRecord& sample = samples[index_];
  if (index_++ == 0) return slot_ = sample.tick;
  const SampleRecord& before = samples[index_ - 2];
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
