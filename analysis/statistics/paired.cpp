// Wilcoxon signed-rank test.
#include "analysis/statistics/paired.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <thread>

#include "analysis/statistics/quantiles.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

struct Signed {
  double size;
  bool positive;
  std::uint64_t twice_rank = 0;  // midranks are multiples of 1/2
};

/// P(V <= v) under the null hypothesis (independent signs with probability 1/2), by convolution
/// over the ranks.
double exact_lower_tail(const std::vector<Signed>& values, std::uint64_t twice_v) {
  std::uint64_t total = 0;
  for (const Signed& value : values) total += value.twice_rank;
  std::vector<double> chance(total + 1);
  chance[0] = 1;
  std::uint64_t reach = 0;
  for (const Signed& value : values) {
    reach += value.twice_rank;
    for (std::uint64_t sum = reach + 1; sum-- > 0;) {
      chance[sum] =
          0.5 * (chance[sum] + (sum >= value.twice_rank ? chance[sum - value.twice_rank] : 0.0));
    }
  }
  double tail = 0;
  for (std::uint64_t sum = 0; sum <= twice_v; ++sum) tail += chance[sum];
  return tail;
}

/// Normal approximation of the same, with the variance of the midranks.
double normal_lower_tail(const std::vector<Signed>& values, std::uint64_t twice_v) {
  double total = 0, squares = 0;
  for (const Signed& value : values) {
    const double r = static_cast<double>(value.twice_rank) / 2;
    total += r;
    squares += r * r;
  }
  const double z = (static_cast<double>(twice_v) / 2 - total / 2) / std::sqrt(squares / 4);
  return cdf(boost::math::normal(), z);
}

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

constexpr std::size_t kManyPairs =
    1000;  // pairs; with more, bootstraps in parallel pay for the start of a thread
constexpr const char* kOnePair = "one participant, so no variance between participants";
constexpr const char* kNoPairs = "no participant has times for both renderers";
constexpr const char* kAllEqual = "all differences are equal (no variance)";

/// Reason why inference from these differences is impossible; empty: possible.
std::string no_inference(const std::vector<double>& differences) {
  if (differences.empty()) return kNoPairs;
  if (differences.size() == 1) return kOnePair;
  return {};
}

bool no_variance(double sd, double centre) {
  return sd <= 1e-10 * std::max(1.0, std::fabs(centre));
}

}  // namespace

Wilcoxon wilcoxon(const std::vector<double>& differences) {
  Wilcoxon test;
  if (differences.empty()) {
    test.undefined = "no participant has times for both renderers";
    return test;
  }
  const double tolerance = 1e-10 * std::max(1.0, std::fabs(mean(differences)));
  std::vector<Signed> values;
  for (const double d : differences) {
    if (std::fabs(d) > tolerance) values.push_back({std::fabs(d), d > 0});
  }
  test.n_nonzero = values.size();
  if (values.empty()) {
    test.undefined = "every difference is zero";
    return test;
  }
  std::sort(values.begin(), values.end(),
            [](const Signed& a, const Signed& b) { return a.size < b.size; });
  std::vector<double> sizes;
  sizes.reserve(values.size());
  for (const Signed& value : values) sizes.push_back(value.size);
  const std::vector<double> ranks = midranks(sizes, tolerance);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i].twice_rank = static_cast<std::uint64_t>(2 * ranks[i]);
  std::uint64_t twice_v = 0, total = 0;
  for (const Signed& value : values) {
    total += value.twice_rank;
    if (value.positive) twice_v += value.twice_rank;
  }
  test.positive_rank_sum = static_cast<double>(twice_v) / 2;
  test.exact = values.size() <= kExactWilcoxon;
  const std::uint64_t lower =
      std::min(twice_v, total - twice_v);  // the distribution of V is symmetric
  const double tail =
      test.exact ? exact_lower_tail(values, lower) : normal_lower_tail(values, lower);
  test.p = std::min(1.0, 2 * tail);
  return test;
}

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

Bootstrap bootstrap_mean(const std::vector<double>& differences, Random& random,
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

double percent_reduction(double log_ratio) { return -100 * std::expm1(log_ratio); }

Interval percent_reduction(const Interval& log_ratio) {
  return {percent_reduction(log_ratio.high), percent_reduction(log_ratio.low)};
}

TTest t_test(const std::vector<double>& differences) {
  TTest test;
  test.undefined = no_inference(differences);
  if (!test.undefined.empty()) return test;
  const double n = static_cast<double>(differences.size()), m = mean(differences);
  test.sd = *standard_deviation(differences);
  test.se = *test.sd / std::sqrt(n);
  test.df = n - 1;
  if (no_variance(*test.sd, m)) {
    test.undefined = kAllEqual;
    return test;
  }
  const boost::math::students_t distribution(n - 1);
  test.t = m / *test.se;
  test.p = std::min(1.0, 2 * cdf(complement(distribution, std::fabs(*test.t))));
  const double half = quantile(distribution, 0.975) * *test.se;
  test.log_ratio_ci95 = Interval{m - half, m + half};
  return test;
}

EffectSize effect_size(const std::vector<double>& differences) {
  EffectSize effect;
  effect.undefined = no_inference(differences);
  if (!effect.undefined.empty()) return effect;
  const double sd = *standard_deviation(differences), m = mean(differences);
  if (no_variance(sd, m)) {
    effect.undefined = kAllEqual;
    return effect;
  }
  effect.dz = m / sd;
  const double df = static_cast<double>(differences.size()) - 1;
  if (df < 2) {
    effect.undefined = "two pairs: Hedges' correction J is 0";
    return effect;
  }
  const double j =
      std::exp(boost::math::lgamma(df / 2) - boost::math::lgamma((df - 1) / 2)) / std::sqrt(df / 2);
  effect.hedges_gz = j * *effect.dz;
  return effect;
}

std::vector<std::optional<double>> holm(const std::vector<std::optional<double>>& p) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i]) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return *p[a] < *p[b]; });
  std::vector<std::optional<double>> adjusted(p.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, static_cast<double>(order.size() - i) * *p[order[i]]);
    adjusted[order[i]] = std::min(1.0, largest);
  }
  return adjusted;
}

std::vector<PairedShape> compare_by_shape(const TrialTable& table, const Description& description,
                                          const RendererPair& pair) {
  std::vector<PairedShape> all(table.shapes.size());
  for (std::size_t s = 0; s < all.size(); ++s) {
    PairedShape& shape = all[s];
    std::vector<double> references, others;
    for (std::size_t p = 0; p < table.participants.size(); ++p) {
      const ParticipantCell nothing;
      const auto& a =
          pair.reference_at ? description.participant_cells[*pair.reference_at][s][p] : nothing;
      const auto& b =
          pair.renderer_at ? description.participant_cells[*pair.renderer_at][s][p] : nothing;
      if (a.n_used > 0 && b.n_used > 0) {
        shape.differences.push_back(b.mean_log - a.mean_log);
        references.push_back(a.mean);
        others.push_back(b.mean);
      } else if (a.n_trials + b.n_trials > 0) {
        DroppedParticipant dropped{p, {}};
        if (a.n_used == 0) dropped.renderers.push_back(pair.reference);
        if (b.n_used == 0) dropped.renderers.push_back(pair.renderer);
        shape.dropped.push_back(std::move(dropped));
      }
    }
    shape.n_pairs = shape.differences.size();
    if (shape.n_pairs == 0) {
      shape.undefined =
          pair.in_data() ? kNoPairs : "only one renderer in the data: nothing to compare";
    } else {
      shape.percent_reduction_arithmetic =
          100 * (mean(references) - mean(others)) / mean(references);
      shape.mean_log_ratio = mean(shape.differences);
      shape.percent_reduction_geometric = percent_reduction(*shape.mean_log_ratio);
    }
    shape.t_test = t_test(shape.differences);
    shape.effect_size = effect_size(shape.differences);
    shape.wilcoxon = wilcoxon(shape.differences);
  }
  return all;
}

void bootstrap_all(const std::vector<PairedShape*>& tests, std::uint64_t seed) {
  std::atomic<std::size_t> next{0};
  // Use a random stream for each, so that the result does not depend on the number of threads.
  const auto work = [&] {
    for (std::size_t i = next++; i < tests.size(); i = next++) {
      Random random(seed, {i});
      tests[i]->bootstrap = bootstrap_mean(tests[i]->differences, random);
      tests[i]->bootstrap.seed = seed;
    }
  };
  std::size_t pairs = 0;
  for (const PairedShape* test : tests) pairs += test->n_pairs;
  std::vector<std::jthread> threads;
  if (pairs > kManyPairs) {
    const std::size_t most = std::max(1U, std::thread::hardware_concurrency());
    threads.reserve(most);
    while (threads.size() + 1 < std::min(most, tests.size())) threads.emplace_back(work);
  }
  work();
}

void adjust_all(const std::vector<PairedShape*>& tests) {
  std::vector<std::optional<double>> p;
  p.reserve(tests.size());
  for (const PairedShape* test : tests) p.push_back(test->t_test.p);
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < tests.size(); ++i) tests[i]->t_test.p_holm = adjusted[i];
}

}  // namespace palpate::analysis
