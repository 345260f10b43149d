#include "protocols/procedures/portable_math.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace palpate::protocols {
namespace {

// ln 2 in two parts, the first with 32 bits: an exponent times it is exact.
constexpr double kLn2High = 0x1.62e42feep-1;
constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
constexpr double kLog2E = 1.4426950408889634;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// 1 / n!
constexpr auto kReciprocalFactorials = [] {
  std::array<double, 16> all{1};
  double factorial = 1;  // exact: 15! has 41 bits
  for (int n = 1; n < 16; ++n) all[n] = 1 / (factorial *= n);
  return all;
}();

/// x 2^k.
double times_power_of_two(double x, int k) {
  if (k < -1000 || k > 1000) return std::ldexp(x, k);
  return x * std::bit_cast<double>(static_cast<std::uint64_t>(1023 + k) << 52);
}

}  // namespace

double portable_exp(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.79) return kInfinity;
  if (x < -745.2) return 0;
  const double k = std::floor(x * kLog2E + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  // Taylor series, |r| <= ln(2) / 2: the term after the last is below 1e-19. Even and odd terms are
  // summed apart: neither sum waits for the other.
  const double r2 = r * r;
  double even = kReciprocalFactorials[14], odd = kReciprocalFactorials[15];
  for (int n = 12; n >= 2; n -= 2) {
    even = even * r2 + kReciprocalFactorials[n];
    odd = odd * r2 + kReciprocalFactorials[n + 1];
  }
  const double beyond = (r2 * even + r * (r2 * odd)) + r;
  return times_power_of_two(1 + beyond, static_cast<int>(k));
}

double portable_log(double x) {
  if (std::isnan(x) || x < 0) return std::numeric_limits<double>::quiet_NaN();
  if (x == 0) return -kInfinity;
  if (std::isinf(x)) return x;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < 0.70710678118654752) {
    m *= 2;
    --exponent;
  }
  // log m = 2 artanh s; s * s <= 0.0295: the term after the last is below 1e-18.
  const double s = (m - 1) / (m + 1);
  const double z = s * s;
  double sum = 0;
  for (int n = 23; n >= 3; n -= 2) sum = (sum + 1.0 / n) * z;
  return exponent * kLn2High + (2 * (s + s * sum) + exponent * kLn2Low);
}

double portable_normal_cdf(double x) {
  if (std::isnan(x)) return x;
  if (x < -8.5) return 0;
  if (x > 8.5) return 1;
  // Marsaglia 2004, "Evaluating the normal distribution", section 3: the series of (Phi(x) - 1/2) /
  // phi(x), until the sum no longer changes.
  double term = x, sum = x, before = 0;
  for (int n = 3; sum != before; n += 2) {
    before = sum;
    term *= x * x / n;
    sum += term;
  }
  const double density = 0.39894228040143268 * portable_exp(-0.5 * x * x);
  const double share = 0.5 + sum * density;
  return share < 0 ? 0 : share > 1 ? 1 : share;
}

}  // namespace palpate::protocols
