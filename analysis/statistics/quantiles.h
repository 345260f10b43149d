#pragma once
// Ranks and quantiles.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace palpate::analysis {

/// Quantile of sorted values, interpolated (type 7 of Hyndman & Fan 1996). \param sorted  not empty
/// \param share  0 to 1
template <class T>
double sorted_quantile(const std::vector<T>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const auto low = static_cast<double>(sorted[below]), high = static_cast<double>(sorted[above]);
  return low + (place - static_cast<double>(below)) * (high - low);
}

/// Quantile of the standard normal distribution; 0 < share < 1.
double normal_quantile(double share);

/// Ranks from 1; ties get the mean of their ranks. \param tolerance values within this above the
/// smallest of their group are tied
std::vector<double> midranks(const std::vector<double>& values, double tolerance = 0);

}  // namespace palpate::analysis
