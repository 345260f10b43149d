#include "analysis/statistics/psychometric_likelihood.h"

#include <algorithm>
#include <cmath>

namespace palpate::analysis {

double PlacedData::least_log_slope() const { return std::log(0.1 / (high - low)); }
double PlacedData::most_log_slope() const { return std::log(40 / spacing); }

PlacedData place_counts(const std::vector<LevelCount>& counts,
                        const protocols::PsychometricFunction& function) {
  PlacedData data;
  std::vector<double>& places = data.places;
  for (const LevelCount& count : counts) {
    const double place = protocols::scale_position(function.scale, count.level);
    data.counts.push_back(
        {place, static_cast<double>(count.trials), static_cast<double>(count.successes)});
    if (std::isfinite(place)) places.push_back(place);
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  if (places.empty()) return data;
  data.low = places.front();
  data.high = places.back();
  if (function.scale == protocols::LevelScale::linear && data.low > 0) data.least = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const double distance = places[i] - places[i - 1];
    if (data.spacing == 0 || distance < data.spacing) data.spacing = distance;
  }
  // Levels that differ by rounding alone are no finer spacing.
  data.spacing = std::max(data.spacing, 1e-3 * (data.high - data.low));
  return data;
}

double psychometric_log_likelihood(const PlacedData& data,
                                   const protocols::PsychometricFunction& function,
                                   double threshold, double slope, double guess, double lapse) {
  constexpr double kLeast = 1e-15;
  double sum = 0;
  for (const PlacedCount& count : data.counts) {
    const double above = count.place - threshold;
    const double distance = function.easier == protocols::Easier::higher ? above : -above;
    const double share = protocols::psychometric_share(function, distance, slope);
    const double p = std::clamp(guess + (1 - guess - lapse) * share, kLeast, 1 - kLeast);
    if (count.successes > 0) sum += count.successes * std::log(p);
    if (count.successes < count.trials) sum += (count.trials - count.successes) * std::log1p(-p);
  }
  return sum;
}

}  // namespace palpate::analysis
