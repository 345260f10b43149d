#include "analysis/statistics/sensitivity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "analysis/statistics/quantiles.h"
#include "data/base/random.h"

namespace palpate::analysis {

namespace {

constexpr const char* kConstant = "the output is the same at all points";

double square(double x) { return x * x; }

/// Outputs of complete base points, minus their mean over A and B.
struct Samples {
  std::size_t parameters = 0;
  std::vector<double> values;          // base points times (parameters + 2)
  std::vector<double> squared_errors;  // for each base point: sum of the known ones
  std::vector<double> with_errors;     // for each base point: number of known ones

  std::size_t size() const { return values.size() / (parameters + 2); }
  const double* at(std::size_t base) const { return &values[base * (parameters + 2)]; }
};

struct Estimates {
  double variance = 0;
  double noise = 0;  // mean squared standard error
  std::vector<double> first, total;
};

/// Sums of a set of base points: cheap to resample.
template <class Chosen>
Estimates estimates(const Samples& samples, const Chosen& chosen) {
  const std::size_t n = samples.size(), k = samples.parameters;
  Estimates out;
  out.first.assign(k, 0);
  out.total.assign(k, 0);
  double sum = 0, squares = 0, squared_errors = 0, with_errors = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double* const f = samples.at(chosen(i));
    squared_errors += samples.squared_errors[chosen(i)];
    with_errors += samples.with_errors[chosen(i)];
    sum += f[0] + f[1];
    squares += square(f[0]) + square(f[1]);
    for (std::size_t p = 0; p < k; ++p) {
      out.first[p] += f[1] * (f[2 + p] - f[0]);
      out.total[p] += square(f[0] - f[2 + p]);
    }
  }
  const auto count = static_cast<double>(n);
  out.variance = squares / (2 * count) - square(sum / (2 * count));
  if (with_errors > 0) out.noise = squared_errors / with_errors;
  for (std::size_t p = 0; p < k; ++p) {
    out.first[p] /= count * out.variance;
    out.total[p] = (out.total[p] / (2 * count) - out.noise) / out.variance;
  }
  return out;
}

Interval percentiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {sorted_quantile(values, 0.025), sorted_quantile(values, 0.975)};
}

Samples complete_samples(const std::vector<double>& outputs, const std::vector<double>& errors,
                         std::size_t parameters, std::size_t& dropped) {
  Samples samples{parameters, {}, {}, {}};
  const std::size_t each = parameters + 2;
  for (std::size_t from = 0; from + each <= outputs.size(); from += each) {
    const auto begin = outputs.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = begin + static_cast<std::ptrdiff_t>(each);
    if (std::any_of(begin, end, [](double x) { return std::isnan(x); })) {
      ++dropped;
    } else {
      samples.values.insert(samples.values.end(), begin, end);
      samples.squared_errors.push_back(0);
      samples.with_errors.push_back(0);
      for (std::size_t i = from; i < std::min(from + each, errors.size()); ++i) {
        if (std::isnan(errors[i])) continue;
        samples.squared_errors.back() += square(errors[i]);
        ++samples.with_errors.back();
      }
    }
  }
  double sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) sum += samples.at(i)[0] + samples.at(i)[1];
  const double centre = samples.size() == 0 ? 0 : sum / (2 * static_cast<double>(samples.size()));
  for (double& value : samples.values) value -= centre;
  return samples;
}

/// None: undefined, as r is 1 or -1, or there are too few points.
std::optional<Interval> correlation_interval(double r, double n, double held) {
  const double freedom = n - held - 3;
  if (!(std::fabs(r) < 1) || !(freedom > 0)) return std::nullopt;
  const double z = std::atanh(r),
               half = normal_quantile(0.975) * std::sqrt((1 + r * r / 2) / freedom);
  return Interval{std::tanh(z - half), std::tanh(z + half)};
}

bool constant(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [&](double x) { return x == values.front(); });
}

/// Correlations of the columns' ranks, the output's last.
Eigen::MatrixXd rank_matrix(const std::vector<std::vector<double>>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.front().size()),
             k = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd ranks(n, k);
  for (Eigen::Index c = 0; c < k; ++c) {
    const std::vector<double> one = midranks(columns[static_cast<std::size_t>(c)]);
    for (Eigen::Index i = 0; i < n; ++i) ranks(i, c) = one[static_cast<std::size_t>(i)];
    ranks.col(c).array() -= ranks.col(c).mean();
    ranks.col(c) /= ranks.col(c).norm();
  }
  return ranks.transpose() * ranks;
}

}  // namespace

SobolIndices sobol_indices(const std::vector<double>& outputs, const std::vector<double>& errors,
                           std::size_t parameters, std::uint64_t seed, std::size_t resamples) {
  SobolIndices out;
  out.of.resize(parameters);
  const Samples samples = complete_samples(outputs, errors, parameters, out.dropped);
  out.base_points = samples.size();
  constexpr std::size_t kFewest = 8;
  if (out.base_points < kFewest) {
    out.undefined = "fewer than " + std::to_string(kFewest) +
                    " base points with an output at each of their samples";
    return out;
  }
  const Estimates all = estimates(samples, [](std::size_t i) { return i; });
  out.variance = all.variance;
  if (constant(samples.values) || !(all.variance > 0)) {
    out.undefined = kConstant;
    return out;
  }
  if (std::any_of(samples.with_errors.begin(), samples.with_errors.end(),
                  [](double n) { return n > 0; }))
    out.noise_share = all.noise / all.variance;
  std::vector<std::vector<double>> first(parameters), total(parameters);
  Random random(seed, {1});
  std::vector<std::size_t> drawn(samples.size());
  for (std::size_t r = 0; r < resamples; ++r) {
    for (std::size_t& one : drawn) one = random.below(samples.size());
    const Estimates again = estimates(samples, [&](std::size_t i) { return drawn[i]; });
    if (!(again.variance > 0)) continue;
    for (std::size_t p = 0; p < parameters; ++p) {
      first[p].push_back(again.first[p]);
      total[p].push_back(again.total[p]);
    }
  }
  for (std::size_t p = 0; p < parameters; ++p) {
    out.of[p].first = all.first[p];
    out.of[p].total = all.total[p];
    if (first[p].empty()) continue;
    out.of[p].first_ci95 = percentiles(std::move(first[p]));
    out.of[p].total_ci95 = percentiles(std::move(total[p]));
  }
  return out;
}

std::vector<RankCorrelation> rank_correlations(const std::vector<std::vector<double>>& inputs,
                                               const std::vector<double>& output) {
  std::vector<RankCorrelation> out(inputs.size());
  std::vector<std::vector<double>> columns;  // with the output, of points where it is defined
  std::vector<std::size_t> used;             // parameters that vary
  const auto defined = [&](const std::vector<double>& column) {
    std::vector<double> kept;
    for (std::size_t i = 0; i < output.size(); ++i) {
      if (!std::isnan(output[i])) kept.push_back(column[i]);
    }
    return kept;
  };
  const std::vector<double> wanted = defined(output);
  for (std::size_t p = 0; p < inputs.size(); ++p) {
    std::vector<double> column = defined(inputs[p]);
    if (wanted.size() < 4) {
      out[p].undefined = "fewer than 4 points with an output";
    } else if (constant(wanted)) {
      out[p].undefined = kConstant;
    } else if (constant(column)) {
      out[p].undefined = "the parameter is the same at all points with an output";
    } else {
      columns.push_back(std::move(column));
      used.push_back(p);
    }
  }
  if (used.empty()) return out;
  columns.push_back(wanted);
  const Eigen::MatrixXd correlations = rank_matrix(columns);
  const Eigen::Index last = correlations.cols() - 1;
  const auto n = static_cast<double>(wanted.size()), held = static_cast<double>(used.size()) - 1;
  const Eigen::FullPivLU<Eigen::MatrixXd> factors(correlations);
  const bool separable = n - held > 3 && factors.isInvertible();
  const Eigen::MatrixXd inverse =
      separable ? Eigen::MatrixXd(factors.inverse()) : Eigen::MatrixXd();
  for (std::size_t u = 0; u < used.size(); ++u) {
    const auto i = static_cast<Eigen::Index>(u);
    RankCorrelation& one = out[used[u]];
    const double r = std::clamp(correlations(i, last), -1.0, 1.0);
    one.spearman = r;
    one.spearman_ci95 = correlation_interval(r, n, 0);
    if (!separable) continue;
    const double partial = -inverse(i, last) / std::sqrt(inverse(i, i) * inverse(last, last));
    if (!std::isfinite(partial)) continue;
    one.partial = std::clamp(partial, -1.0, 1.0);
    one.partial_ci95 = correlation_interval(*one.partial, n, held);
  }
  return out;
}

Interval wilson_interval(std::size_t successes, std::size_t n) {
  const auto count = static_cast<double>(n);
  const double share = static_cast<double>(successes) / count, z = normal_quantile(0.975),
               z2 = z * z;
  const double centre = (share + z2 / (2 * count)) / (1 + z2 / count);
  const double half =
      z / (1 + z2 / count) * std::sqrt(share * (1 - share) / count + z2 / (4 * count * count));
  return {successes == 0 ? 0 : std::max(0.0, centre - half),
          successes == n ? 1 : std::min(1.0, centre + half)};
}

}  // namespace palpate::analysis
