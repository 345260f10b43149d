#pragma once

#include <cmath>

namespace palpate::analysis {

inline constexpr double kLogRoot2Pi = 0.91893853320467274178;
/// Quantiles of the standard normal distribution: 0.75 and 0.975.
inline constexpr double kNormal75 = 0.6744897501960817, kNormal975 = 1.959963984540054;

/// log of the upper tail probability of the standard normal distribution, and its hazard (density /
/// tail).
struct NormalTail {
  double log = 0, hazard = 0;
};

inline NormalTail upper_tail(double z) {
  const double log_density = -0.5 * z * z - kLogRoot2Pi;
  NormalTail tail;
  if (z < 20) {
    tail.log = std::log(0.5 * std::erfc(z / std::sqrt(2.0)));
  } else {  // erfc underflows: Abramowitz & Stegun 26.2.12, relative error below 1e-10 from here on
    const double q = 1 / (z * z);
    tail.log =
        log_density - std::log(z) + std::log1p(-q * (1 - q * (3 - q * (15 - q * (105 - 945 * q)))));
  }
  tail.hazard = std::exp(log_density - tail.log);
  return tail;
}

}  // namespace palpate::analysis
