#include "analysis/statistics/psychometric_bayes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kCoarse = 25, kFine = 81, kRates = 10;

/// Values of a parameter, each in the middle of its share of a range, and their marginal posterior.
struct PosteriorAxis {
  double low = 0, high = 0;
  std::vector<double> values, marginal;

  PosteriorAxis(double from, double to, std::size_t count) : low(from), high(to) {
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(from +
                       (to - from) * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
    marginal.assign(count, 0);
  }

  double width() const { return (high - low) / static_cast<double>(values.size()); }

  double mean() const {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[i] * marginal[i];
    return sum;
  }

  double sd() const {
    const double middle = mean();
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += marginal[i] * (values[i] - middle) * (values[i] - middle);
    return std::sqrt(sum);
  }

  /// The density is even within a share of the range.
  double quantile(double share) const {
    double below = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (below + marginal[i] >= share && marginal[i] > 0)
        return values[i] + width() * ((share - below) / marginal[i] - 0.5);
      below += marginal[i];
    }
    return high;
  }

  /// The part that has all but a millionth on either side, with a margin.
  std::array<double, 2> core() const {
    return {std::max(low, quantile(1e-6) - width()), std::min(high, quantile(1 - 1e-6) + width())};
  }
};

PosteriorAxis rate_axis(const RateModel& rate) {
  return rate.free ? PosteriorAxis(0, rate.most, kRates) : PosteriorAxis(rate.value, rate.value, 1);
}

double log_prior(const RateModel& rate, double value) {
  return rate.free ? 9 * std::log1p(-value) : 0;
}

/// One rate at both ends stands on the axis of lapses alone: that of guesses has one value, unused.
PosteriorAxis guess_axis(const PsychometricModel& model) {
  return rate_axis(model.guess_is_lapse ? RateModel{} : model.guess);
}

struct PosteriorGrid {
  PosteriorAxis threshold, log_slope, guess, lapse;
};

void add_marginals(PosteriorGrid& grid, const PlacedData& data, const PsychometricModel& model) {
  std::vector<double> logs;
  double largest = -1e300;
  for (const double t : grid.threshold.values) {
    for (const double s : grid.log_slope.values) {
      for (const double g : grid.guess.values) {
        for (const double l : grid.lapse.values) {
          const double low = model.guess_is_lapse ? l : g;
          double log_posterior =
              psychometric_log_likelihood(data, model.function, t, std::exp(s), low, l) +
              log_prior(model.lapse, l);
          if (!model.guess_is_lapse) log_posterior += log_prior(model.guess, g);
          logs.push_back(log_posterior);
          largest = std::max(largest, logs.back());
        }
      }
    }
  }
  double sum = 0;
  for (double& value : logs) sum += value = std::exp(value - largest);
  std::size_t i = 0;
  for (double& t : grid.threshold.marginal) {
    for (double& s : grid.log_slope.marginal) {
      for (double& g : grid.guess.marginal) {
        for (double& l : grid.lapse.marginal) {
          const double share = logs[i++] / sum;
          t += share;
          s += share;
          g += share;
          l += share;
        }
      }
    }
  }
}

Interval central(const PosteriorAxis& axis) { return {axis.quantile(0.025), axis.quantile(0.975)}; }

}  // namespace

PsychometricPosterior psychometric_posterior(const std::vector<LevelCount>& counts,
                                             const PsychometricModel& model) {
  PsychometricPosterior result;
  const PlacedData data = place_counts(counts, model.function);
  if (!(data.high > data.low)) {
    result.undefined = "fewer than two levels";
    return result;
  }
  const double half = 0.5 * (data.high - data.low);
  PosteriorGrid coarse{
      PosteriorAxis(std::max(data.low - half, data.least), data.high + half, kCoarse),
      PosteriorAxis(data.least_log_slope(), data.most_log_slope(), kCoarse), guess_axis(model),
      rate_axis(model.lapse)};
  add_marginals(coarse, data, model);
  const auto [t_low, t_high] = coarse.threshold.core();
  const auto [s_low, s_high] = coarse.log_slope.core();
  PosteriorGrid fine{PosteriorAxis(t_low, t_high, kFine), PosteriorAxis(s_low, s_high, kFine),
                     guess_axis(model), rate_axis(model.lapse)};
  add_marginals(fine, data, model);

  const auto level = [&](double place) { return protocols::level_at(model.function.scale, place); };
  const double lapse = fine.lapse.mean();
  result.mean = {level(fine.threshold.mean()), std::exp(fine.log_slope.mean()),
                 model.guess_is_lapse ? lapse : fine.guess.mean(), lapse};
  result.threshold_scale_sd = fine.threshold.sd();
  const Interval threshold = central(fine.threshold), slope = central(fine.log_slope);
  result.threshold_ci95 = {level(threshold.low), level(threshold.high)};
  result.slope_ci95 = {std::exp(slope.low), std::exp(slope.high)};
  result.lapse_ci95 = central(fine.lapse);
  result.guess_ci95 = model.guess_is_lapse ? result.lapse_ci95 : central(fine.guess);
  return result;
}

}  // namespace palpate::analysis
