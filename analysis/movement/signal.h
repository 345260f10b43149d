#pragma once
// The path of a hand before it is measured: low pass and differences. Units of the caller.

#include <cstddef>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::analysis {

/// Low pass by Butterworth, order 2, forwards and backwards: no delay. The single pass is set
/// higher by Winter's factor 0.802, so that both together are down by 3 dB at the cut-off. Ends go
/// on by point reflection. Unchanged where the cut-off is not below half of the rate.
/// \param rate, cutoff  Hz
std::vector<double> low_pass(const std::vector<double>& values, double rate, double cutoff);
std::vector<Vec3> low_pass(const std::vector<Vec3>& path, double rate, double cutoff);

/// Central differences, one-sided at the ends; zero for fewer than two values.
std::vector<Vec3> velocity(const std::vector<Vec3>& path, double rate);
std::vector<double> lengths(const std::vector<Vec3>& vectors);
/// m, sum of the steps.
double path_length(const std::vector<Vec3>& path);

/// From begin to before end.
struct Stretch {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
  friend bool operator==(const Stretch&, const Stretch&) = default;
};
/// The maximal stretches of true.
std::vector<Stretch> stretches(const std::vector<bool>& wanted);

template <class T>
std::vector<T> part_of(const std::vector<T>& all, const Stretch& stretch) {
  return {all.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
          all.begin() + static_cast<std::ptrdiff_t>(stretch.end)};
}

}  // namespace palpate::analysis
