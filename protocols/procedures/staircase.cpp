#include "protocols/procedures/staircase.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace palpate::protocols {

StaircaseRun::StaircaseRun(Staircase spec)
    : spec_(std::move(spec)),
      position_(scale_position(spec_.scale, spec_.start)),
      low_(scale_position(spec_.scale, spec_.min)),
      high_(scale_position(spec_.scale, spec_.max)) {}

std::optional<double> StaircaseRun::next_level() const {
  const int reversals = static_cast<int>(reversals_.size());
  if (trials_ >= spec_.stop_trials ||
      (spec_.stop_reversals.has_value() && reversals >= *spec_.stop_reversals)) {
    return std::nullopt;
  }
  // The ends as they were written: their places on the scale are rounded.
  if (position_ <= low_) return spec_.min;
  if (position_ >= high_) return spec_.max;
  return level_at(spec_.scale, position_);
}

void StaircaseRun::record(const Response& response) {
  if (const auto asked = next_level(); !asked || *asked != response.level)
    position_ = std::clamp(scale_position(spec_.scale, response.level), low_, high_);
  if (position_ <= low_ || position_ >= high_) ++at_limit_;
  ++trials_;
  successes_ = response.success ? successes_ + 1 : 0;
  failures_ = response.success ? 0 : failures_ + 1;
  if (successes_ >= spec_.down) move(true);
  if (failures_ >= spec_.up) move(false);
}

void StaircaseRun::move(bool harder) {
  successes_ = failures_ = 0;
  const int direction = harder ? 1 : -1;
  if (direction_ == -direction) reversals_.push_back(position_);
  direction_ = direction;
  const std::size_t size = std::min(reversals_.size(), spec_.steps.size() - 1);
  const double step = spec_.steps[size] * (harder ? 1 : spec_.step_ratio);
  const bool upwards = harder == (spec_.easier == Easier::lower);
  position_ = std::clamp(position_ + (upwards ? step : -step), low_, high_);
}

std::vector<double> StaircaseRun::reversal_levels() const {
  std::vector<double> levels;
  levels.reserve(reversals_.size());
  for (const double position : reversals_) levels.push_back(level_at(spec_.scale, position));
  return levels;
}

Estimate StaircaseRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  result.reversals = static_cast<int>(reversals_.size());
  result.at_limit = at_limit_;
  auto first = static_cast<std::size_t>(spec_.discard_reversals);
  if (first < reversals_.size() && (reversals_.size() - first) % 2 == 1) ++first;
  if (first >= reversals_.size()) return result;
  double sum = 0;
  for (std::size_t i = first; i < reversals_.size(); ++i) sum += reversals_[i];
  result.threshold = level_at(spec_.scale, sum / static_cast<double>(reversals_.size() - first));
  return result;
}

}  // namespace palpate::protocols
