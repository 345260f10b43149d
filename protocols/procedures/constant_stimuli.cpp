#include "protocols/procedures/constant_stimuli.h"

#include "stimuli/random.h"

namespace palpate::protocols {

ConstantStimuliRun::ConstantStimuliRun(const ConstantStimuli& spec, std::uint64_t seed) {
  stimuli::Random random(seed, {0xc0});
  for (int round = 0; round < spec.repetitions; ++round) {
    std::vector<double> levels = spec.levels;
    random.shuffle(levels);
    order_.insert(order_.end(), levels.begin(), levels.end());
  }
}

std::optional<double> ConstantStimuliRun::next_level() const {
  if (trials_ >= order_.size()) return std::nullopt;
  return order_[trials_];
}

void ConstantStimuliRun::record(const Response& /*response*/) { ++trials_; }

Estimate ConstantStimuliRun::estimate() const {
  Estimate result;
  result.trials = static_cast<int>(trials_);
  return result;
}

}  // namespace palpate::protocols
