#pragma once
// Internal to data/: where the servo ticks of a trial lie in time.

#include <cstdint>

#include "data/store/store.h"

namespace palpate::data {

/// Goes through the samples of one trial. A slot is a period of the servo; every tick was due at
/// the begin of one, and a slot whose tick was missed or is not on record stays empty.
class SampleSlots {
 public:
  /// \param servo_rate Hz
  SampleSlots(const StoredTrial& trial, double servo_rate) : trial_(trial), rate_(servo_rate) {}

  /// The slot of the next sample, counted from the trial's onset. Always later than the one before.
  /// \throws StoreRefused: ticks that do not increase, or that leave out more than any trial could:
  /// the samples are damaged.
  std::int64_t next();

 private:
  const StoredTrial& trial_;
  double rate_;
  std::size_t index_ = 0;
  std::int64_t slot_ = 0;
};

}  // namespace palpate::data
