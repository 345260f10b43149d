#include "runner/participants/seen_record.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate::runner::participants {

std::optional<data::SeenRecord> seen_record(const std::vector<data::FrameRecord>& frames) {
  if (frames.empty()) return std::nullopt;
  constexpr double kNanosecond = 1e-9;  // s
  constexpr double kPause = 0.25;       // s; longer: between intervals
  std::vector<double> lags, steps;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    lags.push_back(kNanosecond *
                   static_cast<double>(frames[i].swap_ns - frames[i].pose_ns - frames[i].delay_ns));
    const double step =
        i == 0 ? kPause
               : kNanosecond * static_cast<double>(frames[i].swap_ns - frames[i - 1].swap_ns);
    if (step < kPause) steps.push_back(step);
  }
  std::ranges::sort(lags);
  std::ranges::sort(steps);
  const auto quantile = [](const std::vector<double>& sorted, double share) {
    return sorted[static_cast<std::size_t>(
        std::lround(share * static_cast<double>(sorted.size() - 1)))];
  };
  data::SeenRecord out;
  out.frames = static_cast<int>(frames.size());
  out.first_ns = frames.front().swap_ns;
  out.lag = quantile(lags, 0.5);
  out.lag_p99 = quantile(lags, 0.99);
  if (steps.empty()) return out;
  const double usual = quantile(steps, 0.5);
  for (const double step : steps) out.dropped += static_cast<int>(std::lround(step / usual)) - 1;
  return out;
}

}  // namespace palpate::runner::participants
