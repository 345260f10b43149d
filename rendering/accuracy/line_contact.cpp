#include "rendering/accuracy/line_contact.h"

#include <cmath>
#include <numbers>

namespace palpate::rendering {
namespace {

/// What a bonded layer gives under a wave of pressure, of what a half-space gives.
/// \param a  wave number times thickness, above 0
double share_of_half_space(double a, double poisson) {
  constexpr double kThick = 40;
  if (a > kThick) return 1;
  const double kappa = 3 - 4 * poisson;
  return (2 * kappa * std::sinh(2 * a) - 4 * a) /
         (2 * kappa * std::cosh(2 * a) + 4 * a * a + 1 + kappa * kappa);
}

}  // namespace

double line_depth(const LineContact& contact, double half_width) {
  // Over wave numbers times a, by Simpson's rule; beyond the last, 1e-6 of it.
  constexpr int kPoints = 4000;
  constexpr double kLast = 100;
  const double h = kLast / kPoints, thick = contact.thickness / half_width;
  const double kappa = 3 - 4 * contact.poisson;
  double sum = 4 * thick * (kappa - 1) / ((kappa + 1) * (kappa + 1));  // at 0
  for (int i = 1; i <= kPoints; ++i) {
    const double k = h * i;
    const double weight = i == kPoints ? 1 : (i % 2 == 1 ? 4 : 2);
    sum += weight * share_of_half_space(k * thick, contact.poisson) / k * 2 *
           std::cyl_bessel_j(1, k) / k;
  }
  return half_width * half_width / (2 * contact.radius) * sum * h / 3;
}

double line_force(const LineContact& contact, double depth) {
  double low = 0, high = contact.radius;
  constexpr int kHalvings = 40;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (line_depth(contact, middle) < depth ? low : high) = middle;
  }
  const double modulus = contact.young / (1 - contact.poisson * contact.poisson);
  return std::numbers::pi * modulus * low * low / (4 * contact.radius);
}

}  // namespace palpate::rendering
