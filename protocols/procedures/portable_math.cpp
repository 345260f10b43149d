#include "protocols/procedures/portable_math.h"

#include <cmath>
#include <limits>

namespace palpate::protocols {
namespace {

// ln 2 in two parts, the first with 32 bits: an exponent times it is exact.
constexpr double kLn2High = 0x1.62e42feep-1;
constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
constexpr double kLog2E = 1.4426950408889634;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

double portable_exp(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.79) return kInfinity;
  if (x < -745.2) return 0;
  const double k = std::floor(x * kLog2E + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  // Taylor series, |r| <= ln(2) / 2: the term after the last is below 1e-19.
  double sum = 1;
  for (int n = 15; n >= 1; --n) sum = 1 + sum * r / n;
  return std::ldexp(sum, static_cast<int>(k));
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
  // Marsaglia 2004, "Evaluating the normal distribution", section 3: the series of
  // (Phi(x) - 1/2) / phi(x), until nothing is added any more.
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
