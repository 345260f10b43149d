// Designs and estimators together, against closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "analysis/statistics/sensitivity.h"
#include "runner/sweep/design.h"

namespace palpate::runner::sweep {
namespace {

std::vector<double> outputs_of(const Design& design,
                               const std::function<double(const std::vector<double>&)>& f) {
  std::vector<double> out;
  for (std::int64_t point = 1; point <= design.size(); ++point) out.push_back(f(design.at(point)));
  return out;
}

struct Truth {
  double first, total;
};

void expect_indices(const analysis::SobolIndices& found, const std::vector<Truth>& truth,
                    double tolerance) {
  ASSERT_EQ(found.of.size(), truth.size());
  for (std::size_t p = 0; p < truth.size(); ++p) {
    EXPECT_NEAR(*found.of[p].first, truth[p].first, tolerance) << p;
    EXPECT_NEAR(*found.of[p].total, truth[p].total, tolerance) << p;
    EXPECT_LE(found.of[p].first_ci95->low, truth[p].first + 1e-9) << p;
    EXPECT_GE(found.of[p].first_ci95->high, truth[p].first - 1e-9) << p;
    EXPECT_LE(found.of[p].total_ci95->low, truth[p].total + 1e-9) << p;
    EXPECT_GE(found.of[p].total_ci95->high, truth[p].total - 1e-9) << p;
  }
}

// Ishigami & Homma (1990): sin x1 + a sin^2 x2 + b x3^4 sin x1 with each x uniform in (-pi, pi).
TEST(SobolIndices, MatchIshigamisFunction) {
  constexpr double a = 7, b = 0.1, pi = std::numbers::pi;
  const Design design(DesignKind::saltelli, 4096 * 5, 20,
                      std::vector<protocols::SweepParameter>(3));
  const auto ishigami = [&](const std::vector<double>& u) {
    const auto x = [&](std::size_t i) { return pi * (2 * u[i] - 1); };
    return std::sin(x(0)) + a * std::pow(std::sin(x(1)), 2) +
           b * std::pow(x(2), 4) * std::sin(x(0));
  };
  const double v1 = 0.5 * std::pow(1 + b * std::pow(pi, 4) / 5, 2), v2 = a * a / 8;
  const double v13 = b * b * std::pow(pi, 8) * (1.0 / 18 - 1.0 / 50), v = v1 + v2 + v13;
  const analysis::SobolIndices found =
      analysis::sobol_indices(outputs_of(design, ishigami), {}, 3, 1);
  EXPECT_NEAR(found.variance, v, 0.01 * v);
  expect_indices(found, {{v1 / v, (v1 + v13) / v}, {v2 / v, v2 / v}, {0, v13 / v}}, 0.01);
}

// A linear model of independent parameters: first-order and total index are each the share of its
// squared coefficient.
TEST(SobolIndices, MatchTheSquaredCoefficientsOfALinearModel) {
  const std::vector<double> coefficients{4, 2, 1, 0};
  const Design design(DesignKind::saltelli, 2048 * 6, 7, std::vector<protocols::SweepParameter>(4));
  const auto linear = [&](const std::vector<double>& u) {
    double sum = 100;
    for (std::size_t i = 0; i < u.size(); ++i) sum += coefficients[i] * u[i];
    return sum;
  };
  const analysis::SobolIndices found =
      analysis::sobol_indices(outputs_of(design, linear), {}, 4, 1);
  EXPECT_NEAR(found.variance, 21.0 / 12, 0.01);
  expect_indices(
      found, {{16.0 / 21, 16.0 / 21}, {4.0 / 21, 4.0 / 21}, {1.0 / 21, 1.0 / 21}, {0, 0}}, 0.01);
}

}  // namespace
}  // namespace palpate::runner::sweep
