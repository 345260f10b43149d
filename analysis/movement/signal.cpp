#include "analysis/movement/signal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

namespace palpate::analysis {
namespace {

/// A second-order section, direct form II transposed.
struct Section {
  double b0, b1, b2, a1, a2;

  /// Starts in steady state at the first value.
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

using Complex = std::complex<double>;

/// Plain product: that of std::complex guards against infinities, which costs more than the
/// transform.
Complex times(const Complex& a, const Complex& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// e^(-2 pi i k / n) for the first half of k.
std::vector<Complex> turns_of(std::size_t n) {
  std::vector<Complex> turns(n / 2);
  for (std::size_t k = 0; k < n / 2; ++k)
    turns[k] =
        std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
  return turns;
}

/// In place, radix 2, e^(-2 pi i k n / N). \param turns  roots of unity for its size
void transform(std::vector<Complex>& x, const std::vector<Complex>& turns) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t half = 1; half < n; half *= 2) {
    const std::size_t stride = n / (2 * half);
    for (std::size_t first = 0; first < n; first += 2 * half) {
      for (std::size_t k = 0; k < half; ++k) {
        const Complex other = times(turns[k * stride], x[first + k + half]);
        x[first + k + half] = x[first + k] - other;
        x[first + k] += other;
      }
    }
  }
}

/// The first bins of the transform of `values` padded with zeros to `padded`, by Bluestein's chirp
/// transform: only the lowest percent of a long transform is needed.
std::vector<double> low_bins(const std::vector<double>& values, std::size_t padded,
                             std::size_t bins) {
  const std::size_t n = values.size();
  std::vector<Complex> chirp(std::max(n, bins));
  for (std::uint64_t i = 0; i < chirp.size(); ++i) {
    const std::uint64_t turn = i * i % (2 * padded);
    chirp[i] = std::polar(
        1.0, -std::numbers::pi * static_cast<double>(turn) / static_cast<double>(padded));
  }
  const std::size_t size = std::bit_ceil(n + bins);
  std::vector<Complex> a(size), b(size);
  for (std::size_t i = 0; i < n; ++i) a[i] = values[i] * chirp[i];
  for (std::size_t i = 0; i < chirp.size(); ++i) {
    const Complex back = std::conj(chirp[i]);
    if (i < bins) b[i] = back;
    if (i > 0 && i < n) b[size - i] = back;
  }
  const std::vector<Complex> turns = turns_of(size);
  transform(a, turns);
  transform(b, turns);
  for (std::size_t i = 0; i < size; ++i) a[i] = std::conj(times(a[i], b[i]));
  transform(a, turns);
  std::vector<double> magnitudes(bins);
  for (std::size_t k = 0; k < bins; ++k) magnitudes[k] = std::abs(a[k]) / static_cast<double>(size);
  return magnitudes;
}

std::optional<double> of_jerk(double duration, double greatest, double integral) {
  const double jerk = duration * duration * duration / (greatest * greatest) * integral;
  if (!(greatest > 0) || !(jerk > 0) || !std::isfinite(jerk)) return std::nullopt;
  return -std::log(jerk);
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

std::optional<double> sparc(const std::vector<double>& speed, double rate) {
  constexpr double kHighest = 10, kLeast = 0.05;
  if (speed.size() < 2) return std::nullopt;
  const std::size_t padded = std::bit_ceil(speed.size()) << 4;
  const double step = rate / static_cast<double>(padded);
  const std::size_t bins =
      std::min(padded, static_cast<std::size_t>(std::floor(kHighest / step)) + 1);
  std::vector<double> v = low_bins(speed, padded, bins);
  const double greatest = v.front();
  if (!(greatest > 0)) return std::nullopt;
  for (double& value : v) value /= greatest;
  std::size_t last = bins - 1;
  while (last > 0 && v[last] < kLeast) --last;
  if (last == 0) return std::nullopt;
  double arc = 0;
  for (std::size_t k = 1; k <= last; ++k)
    arc += std::hypot(1 / static_cast<double>(last), v[k] - v[k - 1]);
  return -arc;
}

std::optional<double> log_dimensionless_jerk(const std::vector<Vec3>& path, double rate) {
  if (path.size() < 5) return std::nullopt;
  const std::vector<double> speed = lengths(velocity(path, rate));
  double sum = 0;
  for (std::size_t i = 3; i < path.size(); ++i) {
    const Vec3 jerk =
        (path[i] - 3.0 * path[i - 1] + 3.0 * path[i - 2] - path[i - 3]) * (rate * rate * rate);
    sum += glm::dot(jerk, jerk);
  }
  return of_jerk(static_cast<double>(path.size()) / rate,
                 *std::max_element(speed.begin(), speed.end()), sum / rate);
}

std::optional<double> log_dimensionless_jerk_of_speed(const std::vector<double>& speed,
                                                      double rate) {
  if (speed.size() < 4) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 2; i < speed.size(); ++i) {
    const double jerk = (speed[i] - 2 * speed[i - 1] + speed[i - 2]) * rate * rate;
    sum += jerk * jerk;
  }
  return of_jerk(static_cast<double>(speed.size()) / rate,
                 *std::max_element(speed.begin(), speed.end()), sum / rate);
}

std::vector<Stretch> movements(const std::vector<double>& speed, double rate, double greatest) {
  constexpr double kShare = 0.05, kShortest = 0.1;
  const double least = kShare * greatest;
  std::vector<bool> moving(speed.size());
  for (std::size_t i = 0; i < speed.size(); ++i) moving[i] = speed[i] > 0 && speed[i] >= least;
  std::vector<Stretch> found = stretches(moving);
  std::erase_if(found, [rate](const Stretch& one) {
    return static_cast<double>(one.size()) < kShortest * rate - 1e-9;
  });
  return found;
}

std::size_t peaks(const std::vector<double>& values, double least) {
  if (values.empty()) return 0;
  // Count alternating rises and falls by `least`. The start is not a rise.
  std::size_t found = 0;
  bool rising = false;
  double lowest = values.front(), highest = values.front();
  for (const double value : values) {
    if (rising) {
      highest = std::max(highest, value);
      if (highest - value >= least && highest > value) {
        ++found;
        rising = false;
        lowest = value;
      }
    } else {
      lowest = std::min(lowest, value);
      if (value - lowest >= least && value > lowest) {
        rising = true;
        highest = value;
      }
    }
  }
  return found;
}

}  // namespace palpate::analysis
