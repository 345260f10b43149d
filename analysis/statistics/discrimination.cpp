#include "analysis/statistics/discrimination.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>

#include "analysis/statistics/normal_tail.h"
#include "analysis/statistics/quantiles.h"
#include "analysis/statistics/sensitivity.h"

namespace palpate::analysis {
namespace {

using protocols::LevelScale;

constexpr double kNoBound = std::numeric_limits<double>::infinity();

const double kSqrt2 = 1.4142135623730951;

double cumulative(double z) { return cdf(boost::math::normal(), z); }
double normal_density(double z) { return pdf(boost::math::normal(), z); }

Interval around(double centre, double se) {
  return {centre - kNormal975 * se, centre + kNormal975 * se};
}

/// Variance of the normal quantile of a rate.
double quantile_variance(double rate, double trials) {
  const double density = normal_density(normal_quantile(rate));
  return rate * (1 - rate) / (trials * density * density);
}

/// Rates of "different" by the difference of two observations, N(+-d', 2) or N(0, 2): with the
/// criterion k on its absolute value (Macmillan & Creelman 2005, 9).
double different_rate(double d, double k) {
  return cumulative((d - k) / kSqrt2) + cumulative((-d - k) / kSqrt2);
}

double same_different_d_prime(double hit, double k) {
  double low = 0, high = 20;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (different_rate(middle, k) < hit ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void add_same_different(Detectability& result, double signal, double noise) {
  const double h = result.hit_rate, f = result.false_alarm_rate;
  const double k = -kSqrt2 * normal_quantile(f / 2);
  result.criterion = k;
  const double slope_k = 2 * normal_density(k / kSqrt2) / kSqrt2;  // -df/dk
  const double variance_f = f * (1 - f) / noise, variance_h = h * (1 - h) / signal;
  result.criterion_ci95 = around(k, std::sqrt(variance_f) / slope_k);
  if (!(h > f)) {
    result.d_prime = 0;  // d' is not below 0 here, and its variance has no normal form at 0
    return;
  }
  const double d = same_different_d_prime(h, k);
  const double near = normal_density((d - k) / kSqrt2), far = normal_density((d + k) / kSqrt2);
  const double by_d = (near - far) / kSqrt2, by_k = (near + far) / kSqrt2;  // dh/dd, -dh/dk
  // h(d, k) is fixed: dd = (dh + by_k dk) / by_d, dk = -df / slope_k.
  const double from_f = by_k / slope_k;
  result.d_prime = d;
  result.d_prime_se = std::sqrt(variance_h + from_f * from_f * variance_f) / by_d;
  result.d_prime_ci95 = around(d, *result.d_prime_se);
}

std::vector<Type2Roc::Point> type2_curve(std::vector<ConfidenceTrial> trials, double correct,
                                         double wrong) {
  std::sort(trials.begin(), trials.end(),
            [](const auto& a, const auto& b) { return a.confidence > b.confidence; });
  std::vector<Type2Roc::Point> curve{{0, 0}};
  Type2Roc::Point at{0, 0};
  for (std::size_t i = 0; i < trials.size(); ++i) {
    (trials[i].correct ? at.correct : at.wrong) += 1 / (trials[i].correct ? correct : wrong);
    if (i + 1 == trials.size() || trials[i + 1].confidence != trials[i].confidence)
      curve.push_back(at);
  }
  return curve;
}

double variance_of_mean(const std::vector<double>& values, double mean_value) {
  double sum = 0;
  for (const double value : values) sum += (value - mean_value) * (value - mean_value);
  const auto n = static_cast<double>(values.size());
  return sum / (n - 1) / n;
}

}  // namespace

Discrimination discrimination(const PsychometricFit& fit,
                              const protocols::PsychometricFunction& function,
                              std::optional<double> standard) {
  const auto level = [&](double threshold, double slope, double share) {
    return psychometric_level(function, {threshold, slope}, share);
  };
  const auto& [threshold, slope, guess, lapse] = fit.parameters;
  Discrimination result;
  result.pse = level(threshold, slope, 0.5);
  // PSE and threshold are equal except for the Weibull function, where the slope is held fixed.
  result.pse_ci95 = {level(fit.threshold_ci95.low, slope, 0.5),
                     level(fit.threshold_ci95.high, slope, 0.5)};
  const auto half = [&](double at_slope) {
    // Depends on the scale only: equal at any threshold.
    const auto place = [&](double share) {
      return protocols::scale_position(function.scale, level(1, at_slope, share));
    };
    return 0.5 * std::abs(place(0.75) - place(0.25));
  };
  const auto& [flat, steep] = fit.slope_ci95;
  const double widest = flat > 0 ? half(flat) : kNoBound;
  const double narrowest = std::isfinite(steep) ? half(steep) : 0;
  if (function.scale == LevelScale::linear) {
    result.jnd = half(slope);
    result.jnd_ci95 = {narrowest, widest};
    const double base = standard.value_or(result.pse);
    if (!(base > 0)) return result;
    result.weber_fraction = *result.jnd / base;
    result.weber_fraction_ci95 = {narrowest / base, widest / base};
    return result;
  }
  const auto ratio = [&](double distance) {
    return std::isfinite(distance) ? protocols::level_at(function.scale, distance) - 1 : kNoBound;
  };
  result.weber_fraction = ratio(half(slope));
  result.weber_fraction_ci95 = {ratio(narrowest), ratio(widest)};
  const double base = standard.value_or(result.pse);
  result.jnd = *result.weber_fraction * base;
  result.jnd_ci95 = {result.weber_fraction_ci95->low * base,
                     result.weber_fraction_ci95->high * base};
  return result;
}

Detectability detectability(const DetectionCounts& counts, DetectionTask task) {
  Detectability result;
  if (counts.signal_trials == 0 || counts.noise_trials == 0) {
    result.undefined =
        counts.signal_trials == 0 ? "no trials with a signal" : "no trials without a signal";
    return result;
  }
  const double signal = counts.signal_trials + 1.0, noise = counts.noise_trials + 1.0;
  result.hit_rate = (counts.hits + 0.5) / signal;
  result.false_alarm_rate = (counts.false_alarms + 0.5) / noise;
  if (task == DetectionTask::same_different) {
    add_same_different(result, signal, noise);
    return result;
  }
  const double zh = normal_quantile(result.hit_rate);
  const double zf = normal_quantile(result.false_alarm_rate);
  const double unit = task == DetectionTask::two_interval ? kSqrt2 : 1;
  const double spread = std::sqrt(quantile_variance(result.hit_rate, signal) +
                                  quantile_variance(result.false_alarm_rate, noise));
  result.d_prime = (zh - zf) / unit;
  result.d_prime_se = spread / unit;
  result.d_prime_ci95 = around(*result.d_prime, *result.d_prime_se);
  result.criterion = -0.5 * (zh + zf) * (task == DetectionTask::two_interval ? kSqrt2 : 1);
  result.criterion_ci95 =
      around(*result.criterion, 0.5 * spread * (task == DetectionTask::two_interval ? kSqrt2 : 1));
  return result;
}

double forced_choice_share(double d_prime, int alternatives) {
  constexpr int kSteps = 400;
  double sum = 0;
  // Trapezoids over the relevant range: error below 1e-12.
  for (int i = 0; i <= kSteps; ++i) {
    const double x = -9 + d_prime + 18.0 * i / kSteps;
    sum += normal_density(x - d_prime) * std::pow(cumulative(x), alternatives - 1);
  }
  return sum * 18.0 / kSteps;
}

std::optional<double> forced_choice_d_prime(double share, int alternatives) {
  if (!(share > 0) || !(share < 1)) return std::nullopt;
  double low = -20, high = 20;
  for (int i = 0; i < 55; ++i) {
    const double middle = 0.5 * (low + high);
    (forced_choice_share(middle, alternatives) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

ForcedChoiceDetectability forced_choice_detectability(int correct, int trials, int alternatives) {
  ForcedChoiceDetectability out;
  out.share = (correct + 0.5) / (trials + 1.0);
  out.d_prime = *forced_choice_d_prime(out.share, alternatives);
  const Interval shares =
      wilson_interval(static_cast<std::size_t>(correct), static_cast<std::size_t>(trials));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  out.d_prime_ci95 = {forced_choice_d_prime(shares.low, alternatives).value_or(-kInfinity),
                      forced_choice_d_prime(shares.high, alternatives).value_or(kInfinity)};
  return out;
}

Type2Roc type2_roc(const std::vector<ConfidenceTrial>& trials) {
  Type2Roc result;
  std::vector<double> correct, wrong;
  for (const ConfidenceTrial& trial : trials)
    (trial.correct ? correct : wrong).push_back(trial.confidence);
  result.correct = static_cast<int>(correct.size());
  result.wrong = static_cast<int>(wrong.size());
  if (correct.empty() || wrong.empty()) {
    result.undefined = correct.empty() ? "no correct answer" : "no wrong answer";
    return result;
  }
  const auto m = static_cast<double>(correct.size()), n = static_cast<double>(wrong.size());
  result.curve = type2_curve(trials, m, n);
  // DeLong's placements: for each correct answer the share of wrong ones below, and the reverse.
  const auto shares_below = [](const std::vector<double>& of, std::vector<double> among) {
    std::sort(among.begin(), among.end());
    std::vector<double> shares;
    for (const double value : of) {
      const auto [first, last] = std::equal_range(among.begin(), among.end(), value);
      shares.push_back(
          (static_cast<double>(first - among.begin()) + 0.5 * static_cast<double>(last - first)) /
          static_cast<double>(among.size()));
    }
    return shares;
  };
  const std::vector<double> below = shares_below(correct, wrong);
  const std::vector<double> above = shares_below(wrong, correct);
  double area = 0;
  for (const double share : below) area += share / m;
  result.area = area;
  if (correct.size() < 2 || wrong.size() < 2) return result;
  result.se = std::sqrt(variance_of_mean(below, area) + variance_of_mean(above, 1 - area));
  if (!(area > 0) || !(area < 1)) return result;
  const double logit = std::log(area / (1 - area)), spread = *result.se / (area * (1 - area));
  const auto share_at = [](double x) { return 1 / (1 + std::exp(-x)); };
  result.area_ci95 = {share_at(logit - kNormal975 * spread), share_at(logit + kNormal975 * spread)};
  return result;
}

}  // namespace palpate::analysis
