#include "protocols/procedures/limits.h"

#include "stimuli/random.h"

namespace palpate::protocols {

std::vector<double> series_levels(const Limits& spec, bool ascending, int inside) {
  const double low = scale_position(spec.scale, spec.low);
  const double high = scale_position(spec.scale, spec.high);
  const double tolerance = 1e-9 * spec.step;  // 0.1 three times is not 0.3
  std::vector<double> levels;
  for (int i = inside;; ++i) {
    const double position = ascending ? low + i * spec.step : high - i * spec.step;
    if (position > high + tolerance || position < low - tolerance) return levels;
    levels.push_back(level_at(spec.scale, position));
  }
}

LimitsRun::LimitsRun(const Limits& spec, std::uint64_t seed) : spec_(spec) {
  stimuli::Random random(seed, {0x71});
  for (int i = 0; i < spec.series; ++i) {
    const bool ascending = spec.ascending_first == (i % 2 == 0);
    const auto choices = static_cast<std::uint64_t>(spec.jitter_steps) + 1;
    const int inside = static_cast<int>(random.below(choices));
    series_.push_back({ascending, series_levels(spec, ascending, inside)});
  }
}

std::optional<double> LimitsRun::next_level() const {
  if (current_ >= series_.size()) return std::nullopt;
  return series_[current_].levels[place_];
}

void LimitsRun::record(const Response& response) {
  if (current_ >= series_.size()) return;
  ++trials_;
  const Series& series = series_[current_];
  const bool success_at_start = series.ascending == (spec_.easier == Easier::lower);
  ++place_;
  if (response.success != success_at_start) {
    const double half = series.ascending ? -0.5 * spec_.step : 0.5 * spec_.step;
    changes_.push_back(scale_position(spec_.scale, response.level) + half);
  } else if (place_ < series.levels.size()) {
    return;
  } else {
    ++unchanged_;
  }
  ++current_;
  place_ = 0;
}

Estimate LimitsRun::estimate() const {
  Estimate result;
  result.trials = trials_;
  result.at_limit = unchanged_;
  if (changes_.empty()) return result;
  double sum = 0;
  for (const double change : changes_) sum += change;
  result.threshold = level_at(spec_.scale, sum / static_cast<double>(changes_.size()));
  return result;
}

}  // namespace palpate::protocols
