#include "analysis/movement/signal.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace palpate::analysis {
namespace {

/// A second-order section, direct form II transposed.
struct Section {
  double b0, b1, b2, a1, a2;

  /// Begins as if the first value had been there for ever.
  void run(std::vector<double>& values) const {
    if (values.empty()) return;
    double s2 = (b2 - a2) * values.front();
    double s1 = (b1 - a1) * values.front() + s2;
    for (double& value : values) {
      const double out = b0 * value + s1;
      s1 = b1 * value - a1 * out + s2;
      s2 = b2 * value - a2 * out;
      value = out;
    }
  }
};

Section butterworth(double rate, double cutoff) {
  const double k = std::tan(std::numbers::pi * cutoff / rate);
  const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  return {k * k * norm, 2 * k * k * norm, k * k * norm, 2 * (k * k - 1) * norm,
          (1 - std::numbers::sqrt2 * k + k * k) * norm};
}

}  // namespace

std::vector<double> low_pass(const std::vector<double>& values, double rate, double cutoff) {
  constexpr double kWinter = 0.802;
  const double single = cutoff / kWinter;
  if (values.size() < 2 || !(cutoff > 0) || single >= rate / 2) return values;
  const Section section = butterworth(rate, single);
  const std::size_t n = values.size();
  const std::size_t pad = std::min(n - 1, static_cast<std::size_t>(std::ceil(1.5 * rate / cutoff)));
  std::vector<double> padded;
  padded.reserve(n + 2 * pad);
  for (std::size_t i = pad; i > 0; --i) padded.push_back(2 * values.front() - values[i]);
  padded.insert(padded.end(), values.begin(), values.end());
  for (std::size_t i = 1; i <= pad; ++i) padded.push_back(2 * values.back() - values[n - 1 - i]);
  section.run(padded);
  std::reverse(padded.begin(), padded.end());
  section.run(padded);
  std::reverse(padded.begin(), padded.end());
  const auto first = padded.begin() + static_cast<std::ptrdiff_t>(pad);
  return {first, first + static_cast<std::ptrdiff_t>(n)};
}

std::vector<Vec3> low_pass(const std::vector<Vec3>& path, double rate, double cutoff) {
  std::vector<Vec3> smooth(path.size());
  std::vector<double> axis(path.size());
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < path.size(); ++i) axis[i] = path[i][k];
    const std::vector<double> passed = low_pass(axis, rate, cutoff);
    for (std::size_t i = 0; i < path.size(); ++i) smooth[i][k] = passed[i];
  }
  return smooth;
}

std::vector<Vec3> velocity(const std::vector<Vec3>& path, double rate) {
  const std::size_t n = path.size();
  std::vector<Vec3> result(n, Vec3(0));
  if (n < 2) return result;
  result.front() = (path[1] - path[0]) * rate;
  result.back() = (path[n - 1] - path[n - 2]) * rate;
  for (std::size_t i = 1; i + 1 < n; ++i) result[i] = (path[i + 1] - path[i - 1]) * (rate / 2);
  return result;
}

std::vector<double> lengths(const std::vector<Vec3>& vectors) {
  std::vector<double> result;
  result.reserve(vectors.size());
  for (const Vec3& vector : vectors) result.push_back(glm::length(vector));
  return result;
}

double path_length(const std::vector<Vec3>& path) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += glm::length(path[i] - path[i - 1]);
  return length;
}

std::vector<Stretch> stretches(const std::vector<bool>& wanted) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i]) continue;
    if (found.empty() || found.back().end != i) found.push_back({i, i});
    found.back().end = i + 1;
  }
  return found;
}

}  // namespace palpate::analysis
