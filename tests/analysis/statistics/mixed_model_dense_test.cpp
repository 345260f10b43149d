// The mixed model against its definition with the dense covariance matrix V of all trials.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "analysis/statistics/mixed_model.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kRenderers = 2;

/// Trials of a study and the matrices of the model; X has treatment coding.
struct DenseStudy {
  std::vector<std::string> shapes;
  ParticipantCells participants;
  MatrixXd x, intercepts,
      slopes;       // indicators: same participant; same participant and both with the ray
  MatrixXd either;  // same participant and one with the ray, twice if both
  VectorXd y;
};

/// \param trials of (participant, renderer, shape)
DenseStudy dense_study(
    std::size_t n_participants, std::size_t n_shapes,
    const std::function<std::size_t(std::size_t, std::size_t, std::size_t)>& trials,
    std::uint64_t seed) {
  Random random(seed);
  DenseStudy out;
  for (std::size_t s = 0; s < n_shapes; ++s) out.shapes.push_back("s" + std::to_string(s));
  out.participants.assign(kRenderers, {n_shapes, std::vector<ParticipantCell>(n_participants)});
  std::vector<std::array<std::size_t, 3>> rows;
  std::vector<double> y;
  for (std::size_t p = 0; p < n_participants; ++p) {
    const double intercept = 0.4 * random.normal(), slope = 0.4 * random.normal();
    for (std::size_t r = 0; r < kRenderers; ++r) {
      for (std::size_t s = 0; s < n_shapes; ++s) {
        ParticipantCell& cell = out.participants[r][s][p];
        cell.n_used = trials(p, r, s);
        const std::size_t first = y.size();
        for (std::size_t i = 0; i < cell.n_used; ++i) {
          rows.push_back({p, r, s});
          y.push_back(2 + 0.1 * static_cast<double>(s) + intercept +
                      static_cast<double>(r) * (slope - 0.2) + 0.4 * random.normal());
          cell.mean_log += y.back() / static_cast<double>(cell.n_used);
        }
        for (std::size_t i = first; i < y.size(); ++i) {
          cell.sum_of_squares_log += (y[i] - cell.mean_log) * (y[i] - cell.mean_log);
        }
      }
    }
  }
  const auto n = static_cast<Index>(y.size()), k = static_cast<Index>(n_shapes);
  out.y = Eigen::Map<const VectorXd>(y.data(), n);
  out.x = MatrixXd::Zero(n, 2 * k);
  out.intercepts = out.slopes = out.either = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    const auto& [p, r, s] = rows[static_cast<std::size_t>(i)];
    const auto ray = static_cast<double>(r);
    const auto shape = static_cast<Index>(s);
    out.x(i, 0) = 1;
    out.x(i, 1) = ray;
    if (s > 0) out.x(i, 1 + shape) = 1;
    if (s > 0) out.x(i, k + shape) = ray;
    for (Index j = 0; j < n; ++j) {
      const auto& other = rows[static_cast<std::size_t>(j)];
      if (other[0] != p) continue;
      const auto other_ray = static_cast<double>(other[1]);
      out.intercepts(i, j) = 1;
      out.slopes(i, j) = ray * other_ray;
      out.either(i, j) = ray + other_ray;
    }
  }
  return out;
}

/// (intercept variance, covariance, slope variance, residual variance).
using Variances = Eigen::Vector4d;

MatrixXd covariance(const DenseStudy& study, const Variances& at) {
  const Index n = study.y.size();
  return at(0) * study.intercepts + at(1) * study.either + at(2) * study.slopes +
         at(3) * MatrixXd::Identity(n, n);
}

struct DenseFit {
  double log_likelihood = 0;
  VectorXd beta;
  MatrixXd vcov;
};

DenseFit dense_fit(const DenseStudy& study, const Variances& at) {
  const Eigen::LLT<MatrixXd> v(covariance(study, at));
  const MatrixXd weighted = v.solve(study.x);
  const Eigen::LLT<MatrixXd> information(study.x.transpose() * weighted);
  DenseFit out;
  out.beta = information.solve(weighted.transpose() * study.y);
  const Index p = study.x.cols();
  out.vcov = information.solve(MatrixXd::Identity(p, p));
  const VectorXd rest = study.y - study.x * out.beta;
  const auto log_determinant = [](const Eigen::LLT<MatrixXd>& factor) {
    return 2 * MatrixXd(factor.matrixL()).diagonal().array().log().sum();
  };
  out.log_likelihood =
      -(static_cast<double>(study.y.size() - p) * std::log(2 * std::numbers::pi) +
        log_determinant(v) + log_determinant(information) + rest.dot(v.solve(rest))) /
      2;
  return out;
}

Variances variances_of(const MixedModel& model) {
  const double a = model.random_sds[0], b = model.random_sds[1];
  return {a * a, model.random_correlations[0].value_or(0) * a * b, b * b,
          *model.residual_sd * *model.residual_sd};
}

/// Central differences of a function of the variances.
Variances gradient(const std::function<double(const Variances&)>& f, const Variances& at,
                   double step) {
  Variances out;
  for (Index i = 0; i < 4; ++i) {
    const Variances by = Variances::Unit(i) * step;
    out(i) = (f(at + by) - f(at - by)) / (2 * step);
  }
  return out;
}

/// Satterthwaite's degrees of freedom of weights' beta by finite differences. They do not depend on
/// the parametrisation: variances are used instead of theta and sigma.
double satterthwaite(const DenseStudy& study, const Variances& at, const VectorXd& weights) {
  constexpr double kStep = 1e-4;
  const auto variance = [&](const Variances& v) {
    return weights.dot(dense_fit(study, v).vcov * weights);
  };
  const auto likelihood = [&](const Variances& v) { return dense_fit(study, v).log_likelihood; };
  Eigen::Matrix4d hessian;
  for (Index i = 0; i < 4; ++i) {
    const Variances by = Variances::Unit(i) * kStep;
    hessian.col(i) =
        (gradient(likelihood, at + by, kStep) - gradient(likelihood, at - by, kStep)) / (2 * kStep);
  }
  const Variances slope = gradient(variance, at, kStep);
  const double value = variance(at);
  return 2 * value * value / slope.dot((-hessian).inverse() * slope);
}

void expect_by_definition(const DenseStudy& study) {
  const MixedModel model = mixed_model(study.participants, {"point", "ray"}, study.shapes);
  ASSERT_EQ(model.undefined, "");
  ASSERT_EQ(model.singular, "");
  EXPECT_EQ(model.n_observations, static_cast<std::size_t>(study.y.size()));
  const Variances at = variances_of(model);
  const DenseFit fit = dense_fit(study, at);
  EXPECT_NEAR(*model.log_likelihood_reml, fit.log_likelihood, 1e-8);
  const auto likelihood = [&](const Variances& v) { return dense_fit(study, v).log_likelihood; };
  EXPECT_LT(gradient(likelihood, at, 1e-5).norm(), 1e-4) << "the optimum";

  const auto k = static_cast<Index>(study.shapes.size());
  ASSERT_EQ(model.fixed_effects.size(), 2 * study.shapes.size());
  for (Index i = 0; i < 2 * k; ++i) {
    const FixedEffect& effect = model.fixed_effects[static_cast<std::size_t>(i)];
    EXPECT_NEAR(*effect.value.estimate, fit.beta(i), 1e-9) << effect.name;
    EXPECT_NEAR(*effect.value.se, std::sqrt(fit.vcov(i, i)), 1e-9) << effect.name;
  }
  for (Index s = 0; s < k; ++s) {
    VectorXd weights = VectorXd::Unit(2 * k, 1);
    if (s > 0) weights(k + s) = 1;
    const ModelEstimate& contrast = model.contrasts[0][static_cast<std::size_t>(s)];
    EXPECT_NEAR(*contrast.estimate, weights.dot(fit.beta), 1e-9) << s;
    EXPECT_NEAR(*contrast.se, std::sqrt(weights.dot(fit.vcov * weights)), 1e-9) << s;
    if (s > 1) continue;
    const double df = satterthwaite(study, at, weights);
    EXPECT_NEAR(*contrast.df_satterthwaite, df, 2e-3 * df) << s;
  }
}

TEST(MixedModelByDefinition, ABalancedStudyIsFittedAsDefined) {
  expect_by_definition(dense_study(
      6, 3, [](auto...) { return 3; }, 1));
}

TEST(MixedModelByDefinition, FitsUnbalancedStudiesWithGapsAsDefined) {
  expect_by_definition(dense_study(
      8, 3, [](std::size_t p, std::size_t r, std::size_t s) { return (p * p + 3 * r + 2 * s) % 4; },
      2));
}

TEST(MixedModelByDefinition, MoreShapesThanParticipantsAreFittedAsDefined) {
  expect_by_definition(dense_study(
      9, 12, [](std::size_t p, std::size_t r, std::size_t s) { return (p + r + s * s) % 3; }, 3));
}

TEST(MixedModelByDefinition, OneRendererOnly) {
  expect_by_definition(dense_study(
      9, 2, [](std::size_t p, std::size_t r, std::size_t s) { return p > 6 && r == 1 ? 0 : 3 + s; },
      4));
}

}  // namespace
}  // namespace palpate::analysis
