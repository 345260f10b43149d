#pragma once
// Levels and grids of simulated studies.

#include <cstddef>
#include <vector>

namespace palpate::analysis {

/// Values from `low` to `high`, evenly spaced. \param count  at least two
inline std::vector<double> evenly(double low, double high, int count) {
  std::vector<double> values(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    values[static_cast<std::size_t>(i)] = low + (high - low) * i / (count - 1);
  return values;
}

}  // namespace palpate::analysis
