#include "analysis/statistics/psychometric_likelihood.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace palpate::analysis {
namespace {

constexpr double kWorst = std::numeric_limits<double>::infinity();
constexpr PsychometricSearch kOneStart{21, 19, 1};

double rate_of(const RateModel& rate, double x) {
  const double s = std::sin(x);
  return rate.most * s * s;
}

bool searched(const RateModel& rate, const std::optional<double>& held) {
  return rate.free && !held;
}

}  // namespace

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
  // Ignore differences of levels by rounding alone.
  data.spacing = std::max(data.spacing, 1e-3 * (data.high - data.low));
  return data;
}

PsychometricObjective::Point PsychometricObjective::point(const std::vector<double>& x) const {
  std::size_t i = 0;
  Point p{};
  p.threshold = std::max(threshold_ ? *threshold_ : x[i++], data_.least);
  p.log_slope = std::clamp(log_slope_ ? *log_slope_ : x[i++], data_.least_log_slope(),
                           data_.most_log_slope());
  const auto rate = [&](const RateModel& model, const std::optional<double>& held) {
    return searched(model, held) ? rate_of(model, x[i++]) : held.value_or(model.value);
  };
  if (!model_.guess_is_lapse) p.guess = rate(model_.guess, guess_);
  p.lapse = rate(model_.lapse, lapse_);
  if (model_.guess_is_lapse) p.guess = p.lapse;
  return p;
}

double PsychometricObjective::operator()(const std::vector<double>& x) const {
  const Point p = point(x);
  return -psychometric_log_likelihood(data_, model_.function, p.threshold, std::exp(p.log_slope),
                                      p.guess, p.lapse);
}

SimplexMinimum PsychometricObjective::best_from(const std::vector<double>& start, double step,
                                                double tolerance) const {
  std::vector<double> steps;
  if (!threshold_) steps.push_back(step * (data_.high - data_.low));
  while (steps.size() < start.size()) steps.push_back(3 * step);
  return minimize([this](const std::vector<double>& x) { return (*this)(x); }, start, steps,
                  tolerance);
}

SimplexMinimum PsychometricObjective::best(const PsychometricSearch& search,
                                           double tolerance) const {
  SimplexMinimum found;
  found.value = kWorst;
  std::vector<Start> starts = starts_of_grid(search);
  // Add the starts of the quick search, so that no search ends worse than it.
  if (search.starts > kQuickSearch.starts) {
    for (Start& start : starts_of_grid(kQuickSearch)) starts.push_back(std::move(start));
  }
  for (const Start& start : starts) {
    SimplexMinimum one = best_from(start.place, 0.1, tolerance);
    if (one.value < found.value) found = std::move(one);
  }
  return found;
}

std::optional<std::vector<double>> PsychometricObjective::other_start(
    const std::vector<double>& place) const {
  const std::vector<Start> starts = starts_of_grid(kOneStart);
  if (starts.empty()) return std::nullopt;
  const double cell =
      threshold_ ? (data_.most_log_slope() - data_.least_log_slope()) / (kOneStart.slopes - 1)
                 : (data_.high - data_.low) / (kOneStart.thresholds - 1);
  const bool far = std::abs(starts.front().place[0] - place[0]) > 2 * cell;
  return far ? std::optional(starts.front().place) : std::nullopt;
}

/// Rates of the grid, as best_from takes them: near 0 and near their maximum.
std::vector<std::vector<double>> PsychometricObjective::rates_of_grid() const {
  std::vector<std::vector<double>> all{{}};
  const std::size_t rates =
      (model_.guess_is_free() && !guess_ ? 1U : 0U) + (searched(model_.lapse, lapse_) ? 1U : 0U);
  for (std::size_t i = 0; i < rates; ++i) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& one : all) {
      for (const double x : {0.25, 1.3}) {
        longer.push_back(one);
        longer.back().push_back(x);
      }
    }
    all = std::move(longer);
  }
  return all;
}

/// The best points, each at least two cells from better ones.
std::vector<PsychometricObjective::Start> PsychometricObjective::starts_of_grid(
    const PsychometricSearch& search) const {
  constexpr int kApart = 2;
  const double range = data_.high - data_.low;
  const double flat = data_.least_log_slope(), steep = data_.most_log_slope();
  std::vector<Start> all;
  const std::vector<std::vector<double>> rates = rates_of_grid();
  for (int t = 0; t < (threshold_ ? 1 : search.thresholds); ++t) {
    for (int s = 0; s < (log_slope_ ? 1 : search.slopes); ++s) {
      Start best;
      best.value = kWorst;
      for (const std::vector<double>& rate : rates) {
        std::vector<double> place;
        if (!threshold_) place.push_back(data_.low + range * t / (search.thresholds - 1));
        if (!log_slope_) place.push_back(flat + (steep - flat) * s / (search.slopes - 1));
        place.insert(place.end(), rate.begin(), rate.end());
        const double value = (*this)(place);
        if (value < best.value) best = {value, t, s, std::move(place)};
      }
      if (best.value < kWorst) all.push_back(std::move(best));
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Start& a, const Start& b) { return a.value < b.value; });
  std::vector<Start> chosen;
  for (Start& one : all) {
    const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const Start& other) {
      return std::abs(one.threshold - other.threshold) < kApart &&
             std::abs(one.slope - other.slope) < kApart;
    });
    if (!near) chosen.push_back(std::move(one));
    if (chosen.size() >= search.starts) break;
  }
  return chosen;
}

}  // namespace palpate::analysis
