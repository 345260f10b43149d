#include "analysis/statistics/sensitivity.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/statistics/describe.h"
#include "stimuli/random.h"

namespace palpate::analysis {

namespace {

constexpr double kNormal975 = 1.959963984540054;  // quantile 0.975 of the normal distribution
constexpr const char* kConstant = "the output is the same at all points";

double square(double x) { return x * x; }

/// Outputs of base points without gaps, less their mean over A and B.
struct Samples {
  std::size_t parameters = 0;
  std::vector<double> values;  // base points times (parameters + 2)

  std::size_t size() const { return values.size() / (parameters + 2); }
  const double* at(std::size_t base) const { return &values[base * (parameters + 2)]; }
};

struct Estimates {
  double variance = 0;
  std::vector<double> first, total;
};

/// Sums of a set of base points: cheap to resample.
template <class Chosen>
Estimates estimates(const Samples& samples, const Chosen& chosen) {
  const std::size_t n = samples.size(), k = samples.parameters;
  Estimates out;
  out.first.assign(k, 0);
  out.total.assign(k, 0);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double* const f = samples.at(chosen(i));
    sum += f[0] + f[1];
    squares += square(f[0]) + square(f[1]);
    for (std::size_t p = 0; p < k; ++p) {
      out.first[p] += f[1] * (f[2 + p] - f[0]);
      out.total[p] += square(f[0] - f[2 + p]);
    }
  }
  const auto count = static_cast<double>(n);
  out.variance = squares / (2 * count) - square(sum / (2 * count));
  for (std::size_t p = 0; p < k; ++p) {
    out.first[p] /= count * out.variance;
    out.total[p] /= 2 * count * out.variance;
  }
  return out;
}

Interval percentiles(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {sorted_quantile(values, 0.025), sorted_quantile(values, 0.975)};
}

Samples complete_samples(const std::vector<double>& outputs, std::size_t parameters,
                         std::size_t& dropped) {
  Samples samples{parameters, {}};
  const std::size_t each = parameters + 2;
  for (std::size_t from = 0; from + each <= outputs.size(); from += each) {
    const auto begin = outputs.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = begin + static_cast<std::ptrdiff_t>(each);
    if (std::any_of(begin, end, [](double x) { return std::isnan(x); })) {
      ++dropped;
    } else {
      samples.values.insert(samples.values.end(), begin, end);
    }
  }
  double sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) sum += samples.at(i)[0] + samples.at(i)[1];
  const double centre = samples.size() == 0 ? 0 : sum / (2 * static_cast<double>(samples.size()));
  for (double& value : samples.values) value -= centre;
  return samples;
}

Interval fisher_interval(double r, double error) {
  const double z = std::atanh(r);
  return {std::tanh(z - kNormal975 * error), std::tanh(z + kNormal975 * error)};
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

double sorted_quantile(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

SobolIndices sobol_indices(const std::vector<double>& outputs, std::size_t parameters,
                           std::uint64_t seed, std::size_t resamples) {
  SobolIndices out;
  out.of.resize(parameters);
  const Samples samples = complete_samples(outputs, parameters, out.dropped);
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
  std::vector<std::vector<double>> first(parameters), total(parameters);
  stimuli::Random random(seed, {1});
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

std::vector<double> midranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
    while (to < order.size() && values[order[to]] == values[order[from]]) ++to;
    for (std::size_t i = from; i < to; ++i)
      ranks[order[i]] = static_cast<double>(from + 1 + to) / 2;
  }
  return ranks;
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
  const auto n = static_cast<double>(wanted.size());
  const double freedom = n - static_cast<double>(used.size()) - 2;
  const Eigen::FullPivLU<Eigen::MatrixXd> factors(correlations);
  const bool separable = freedom > 1 && factors.isInvertible();
  const Eigen::MatrixXd inverse =
      separable ? Eigen::MatrixXd(factors.inverse()) : Eigen::MatrixXd();
  for (std::size_t u = 0; u < used.size(); ++u) {
    const auto i = static_cast<Eigen::Index>(u);
    RankCorrelation& one = out[used[u]];
    const double r = std::clamp(correlations(i, last), -1.0, 1.0);
    one.spearman = r;
    if (std::fabs(r) < 1)
      one.spearman_ci95 = fisher_interval(r, std::sqrt((1 + r * r / 2) / (n - 3)));
    if (!separable) continue;
    const double partial = -inverse(i, last) / std::sqrt(inverse(i, i) * inverse(last, last));
    if (!std::isfinite(partial)) continue;
    one.partial = std::clamp(partial, -1.0, 1.0);
    if (std::fabs(*one.partial) < 1)
      one.partial_ci95 = fisher_interval(*one.partial, 1 / std::sqrt(freedom - 1));
  }
  return out;
}

Interval wilson_interval(std::size_t successes, std::size_t n) {
  const auto count = static_cast<double>(n);
  const double share = static_cast<double>(successes) / count, z2 = kNormal975 * kNormal975;
  const double centre = (share + z2 / (2 * count)) / (1 + z2 / count);
  const double half = kNormal975 / (1 + z2 / count) *
                      std::sqrt(share * (1 - share) / count + z2 / (4 * count * count));
  return {successes == 0 ? 0 : std::max(0.0, centre - half),
          successes == n ? 1 : std::min(1.0, centre + half)};
}

}  // namespace palpate::analysis
