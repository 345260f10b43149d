#pragma once
// Branch-free single-precision functions that compilers can vectorise (loops with calls to libm are
// not vectorised without -ffast-math). Only + - * / and sqrt, so results are the same to the bit on
// every machine.

#include <bit>
#include <cmath>
#include <cstdint>

namespace palpate::runner::participants::lane {

inline float max(float a, float b) { return a > b ? a : b; }
inline float min(float a, float b) { return a < b ? a : b; }
inline float clamp(float x, float low, float high) { return min(max(x, low), high); }
inline float positive(float x) { return x > 0.0f ? x : 0.0f; }
inline float sign(float x) { return x < 0.0f ? -1.0f : 1.0f; }

/// e^x for x <= 88. Relative error below 3e-7; clamped to e^-87 below x = -87.
inline float exp(float x) {
  x = x > -87.0f ? x : -87.0f;
  // Adding 1.5 * 2^23 rounds to an integer and leaves it in the low bits of the mantissa.
  constexpr float kRounder = 12582912.0f;
  const float shifted = x * 1.44269504f + kRounder;
  const float n = shifted - kRounder;
  // ln 2 in two parts: the first has few enough bits that n times it is exact.
  const float r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
  // Taylor, |r| <= ln(2) / 2: the first term left out is r^7 / 5040 < 1.2e-7.
  const float p =
      1.0f +
      r * (1.0f +
           r * (1.0f / 2 + r * (1.0f / 6 + r * (1.0f / 24 + r * (1.0f / 120 + r * (1.0f / 720))))));
  const std::uint32_t exponent =
      (std::bit_cast<std::uint32_t>(shifted) - std::bit_cast<std::uint32_t>(kRounder) + 127u)
      << 23u;
  return p * std::bit_cast<float>(exponent);
}

/// ln x for positive normal x. Absolute error below 2e-7 + 1.2e-7 |ln x|.
inline float log(float x) {
  // x = m 2^n with m in [sqrt(1/2), sqrt(2)).
  constexpr std::uint32_t kRootHalf = 0x3f3504f3;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto n = static_cast<std::int32_t>(bits - kRootHalf) >> 23;
  const float m = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(n) << 23u));
  // ln m = 2 artanh f; the first term left out is 2 f^9 / 9 < 3e-8.
  const float f = (m - 1.0f) / (m + 1.0f);
  const float g = f * f;
  const float series = 1.0f + g * (1.0f / 3 + g * (1.0f / 5 + g * (1.0f / 7)));
  return static_cast<float>(n) * 0.693147181f + 2.0f * f * series;
}

/// From here on ln Phi(x) is exactly zero.
inline constexpr float kLogNormalCdfIsZero = 6.0f;

/// ln Phi(x), Phi the standard normal distribution function.
/// Absolute error below 5e-6 for x > -5, relative error below 1e-6 beyond.
inline float log_normal_cdf(float x) {
  // erfc(a) = t exp(-a^2 + h(t)) with t = 1 / (1 + a/2), a >= 0; h is smooth on all of [0, 1].
  // Coefficients: our own Chebyshev interpolation of h in y = 2 t - 1, degree 7, error 3e-6.
  const float a = std::fabs(x) * 0.707106781f;
  const float t = 1.0f / (1.0f + 0.5f * a);
  const float y = 2.0f * t - 1.0f;
  float h = -0.001297829f;
  h = h * y + 0.00136074639f;
  h = h * y + 0.00814063271f;
  h = h * y - 0.00961388235f;
  h = h * y - 0.0467184495f;
  h = h * y + 0.047291129f;
  h = h * y + 0.672630484f;
  h = h * y - 0.671792452f;
  const float lower = lane::log(0.5f * t) + h - a * a;  // ln Phi(-|x|)
  const float upper = lane::log(1.0f - lane::exp(lower));
  return x < 0.0f ? lower : upper;
}

}  // namespace palpate::runner::participants::lane
