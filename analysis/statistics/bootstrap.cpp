#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/quantiles.h"
#include "stimuli/random.h"

namespace palpate::analysis {

namespace {

double normal_cdf(double z) { return cdf(boost::math::normal(), z); }

/// Quantile of sorted resamples, interpolated on the scale of normal quantiles
/// (Davison & Hinkley 1997, eq. 5.8).
double resample_quantile(const std::vector<double>& sorted, double p) {
  const double count = static_cast<double>(sorted.size());
  const double position = (count + 1) * p, whole = std::floor(position);
  if (whole < 1) return sorted.front();
  if (whole >= count) return sorted.back();
  const double below = sorted[static_cast<std::size_t>(whole) - 1];
  const double above = sorted[static_cast<std::size_t>(whole)];
  const double z = normal_quantile(p), z_below = normal_quantile(whole / (count + 1)),
               z_above = normal_quantile((whole + 1) / (count + 1));
  return below + (z - z_below) / (z_above - z_below) * (above - below);
}

}  // namespace

Bootstrap bca_interval(const std::vector<double>& differences, std::vector<double>& means) {
  Bootstrap out;
  out.resamples = means.size();
  const double m = mean(differences);
  const double sd = *standard_deviation(differences);
  std::sort(means.begin(), means.end());

  // Resampled means equal to the mean (frequent for few participants) count half on each side; the
  // tolerance allows for rounding of sums in another order.
  const double tolerance = 1e-12 * std::max(std::fabs(m), sd);
  const auto below = std::lower_bound(means.begin(), means.end(), m - tolerance) - means.begin();
  const auto up_to = std::upper_bound(means.begin(), means.end(), m + tolerance) - means.begin();
  const double proportion =
      static_cast<double>(below + up_to) / (2 * static_cast<double>(means.size()));
  if (proportion <= 0 || proportion >= 1) {
    out.undefined = "every resample lies on one side of the mean";
    return out;
  }
  out.bias_correction = normal_quantile(proportion);

  double squares = 0, cubes = 0;
  for (const double d : differences) {
    squares += (d - m) * (d - m);
    cubes += (d - m) * (d - m) * (d - m);
  }
  // Jackknife influence of the mean: (n - 1)(mean - mean without i) = d_i - mean.
  out.acceleration = cubes / (6 * std::pow(squares, 1.5));

  const auto end = [&](double z) {
    const double shifted = *out.bias_correction + z;
    const double adjusted =
        normal_cdf(*out.bias_correction + shifted / (1 - *out.acceleration * shifted));
    return resample_quantile(means, adjusted);
  };
  const double z = normal_quantile(0.975);
  out.log_ratio_ci95 = Interval{end(-z), end(z)};
  return out;
}

std::optional<double> bca_coverage(std::size_t pairs) {
  // Element i: i + 2 pairs. With 2 the interval is their range, whose coverage is exactly 1/2; the
  // others are simulated, 5,000 studies each: tests/analysis/fixtures/bca_coverage.R.
  constexpr std::array kCoverage{0.50, 0.73, 0.79, 0.84, 0.87, 0.88, 0.89, 0.90, 0.90,
                                 0.91, 0.91, 0.91, 0.92, 0.92, 0.92, 0.92, 0.92, 0.92};
  if (pairs < 2 || pairs - 2 >= kCoverage.size()) return std::nullopt;
  return kCoverage[pairs - 2];
}

Bootstrap bootstrap_mean(const std::vector<double>& differences, stimuli::Random& random,
                         std::size_t resamples) {
  Bootstrap out;
  const TTest spread = t_test(differences);  // undefined in the same cases
  if (!spread.undefined.empty()) {
    out.undefined = spread.undefined;
    return out;
  }
  std::vector<double> means(resamples);
  for (double& resample : means) {
    double sum = 0;
    for (std::size_t i = 0; i < differences.size(); ++i) {
      sum += differences[random.below(differences.size())];
    }
    resample = sum / static_cast<double>(differences.size());
  }
  return bca_interval(differences, means);
}

}  // namespace palpate::analysis
