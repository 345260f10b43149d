#pragma once
// The servo period of every sample, counted from the onset of its trial.

#include <cstdint>

#include "data/store/store.h"

namespace palpate::data {

/// From the first tick with forces on to the response, s.
double duration_of(const TrialRecord& record);

/// Iterates over the samples of one trial. A slot is one servo period; every tick was scheduled at
/// the begin of one. A slot without a sample is a missed tick, or lies between two intervals, each
/// of which counts its ticks from 0.
class SampleSlots {
 public:
  /// \param servo_rate Hz
  SampleSlots(const StoredTrial& trial, double servo_rate) : trial_(trial), rate_(servo_rate) {}

  /// The slot of the next sample, from the first onset of the trial; strictly increasing.
  /// \throws StoreRefused: ticks do not increase, or have an impossible gap: the samples are
  /// damaged.
  std::int64_t next();
  /// The interval of the sample that next() returned last, from 1.
  int interval() const { return interval_ + 1; }

 private:
  std::int64_t begin_of_next_interval();

  const StoredTrial& trial_;
  double rate_;
  std::size_t index_ = 0;
  std::int64_t slot_ = 0;
  int interval_ = 0;
};

}  // namespace palpate::data
