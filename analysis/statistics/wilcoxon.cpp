// Wilcoxon signed-rank test.

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdint>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/quantiles.h"

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

}  // namespace palpate::analysis
