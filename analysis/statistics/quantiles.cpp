#include "analysis/statistics/quantiles.h"

#include <boost/math/distributions/normal.hpp>
#include <numeric>

namespace palpate::analysis {

double normal_quantile(double share) { return quantile(boost::math::normal(), share); }

std::vector<double> midranks(const std::vector<double>& values, double tolerance) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  const auto tied = [&](std::size_t a, std::size_t b) {
    return values[a] == values[b] || values[b] - values[a] <= tolerance;
  };
  for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
    to = from + 1;
    while (to < order.size() && tied(order[from], order[to])) ++to;
    for (std::size_t i = from; i < to; ++i)
      ranks[order[i]] = static_cast<double>(from + 1 + to) / 2;
  }
  return ranks;
}

}  // namespace palpate::analysis
