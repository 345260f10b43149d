#include "analysis/statistics/model_tester.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstddef>
#include <utility>

#include "analysis/statistics/anova.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Pseudo-inverse of the full Hessian: without directions of zero curvature.
MatrixXd inverse_of_curved(const MatrixXd& hessian) {
  const VectorXd scale =
      hessian.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scale.asDiagonal() * hessian *
                                                      scale.asDiagonal());
  const VectorXd inverse =
      eigen.eigenvalues().unaryExpr([](double e) { return e > 1e-10 ? 1 / e : 0.0; });
  return scale.asDiagonal() * eigen.eigenvectors() * inverse.asDiagonal() *
         eigen.eigenvectors().transpose() * scale.asDiagonal();
}

}  // namespace

ModelTester::ModelTester(const ReducedModel& data, const RemlPoint& point)
    : data_(data),
      point_(point),
      means_(data.cell_means(point.beta)),
      spread_(2 * inverse_of_curved(point.full_hessian)) {}

ModelEstimate ModelTester::operator()(const VectorXd& weights) const {
  ModelEstimate out;
  out.estimate = weights.dot(means_);
  const ReducedModel::Loading load = data_.load(weights);
  const VectorXd loaded = point_.inverse_xx * load.inside;
  const double variance = point_.sigma_squared * (load.inside.dot(loaded) + load.outside);
  out.se = std::sqrt(variance);
  const auto n_theta = static_cast<Index>(point_.information_loss.size());
  VectorXd slope(n_theta + 1);
  for (Index k = 0; k < n_theta; ++k) {
    slope(k) = point_.sigma_squared *
               loaded.dot(point_.information_loss[static_cast<std::size_t>(k)] * loaded);
  }
  slope(n_theta) = 2 * variance / std::sqrt(point_.sigma_squared);
  const double df = 2 * variance * variance / slope.dot(spread_ * slope);
  namespace bm = boost::math;
  using Gentle = bm::policies::policy<bm::policies::overflow_error<bm::policies::ignore_error>>;
  if (!(df > 0) || !std::isfinite(df)) {
    out.undefined = "Satterthwaite's degrees of freedom cannot be computed";
    return out;
  }
  out.df_satterthwaite = df;
  const bm::students_t_distribution<double, Gentle> distribution(df);
  const double half = *out.se * quantile(distribution, 0.975);
  if (!std::isfinite(half)) {
    out.undefined = "too few degrees of freedom";
    return out;
  }
  out.t = *out.estimate / *out.se;
  out.p = std::min(1.0, 2 * cdf(complement(distribution, std::fabs(*out.t))));
  out.ci95 = Interval{*out.estimate - half, *out.estimate + half};
  return out;
}

GroupEffect ModelTester::joint(const MatrixXd& rows, std::string name) const {
  GroupEffect out;
  out.name = std::move(name);
  const Index q = rows.rows();
  const auto variance = [&](const VectorXd& weights) {
    const double se = (*this)(weights).se.value_or(0);
    return se * se;
  };
  MatrixXd spread(q, q);
  for (Index i = 0; i < q; ++i) {
    for (Index j = 0; j <= i; ++j) {
      const VectorXd a = rows.row(i).transpose(), b = rows.row(j).transpose();
      spread(i, j) = spread(j, i) = i == j ? variance(a) : (variance(a + b) - variance(a - b)) / 4;
    }
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(spread);
  double sum = 0, excess = 0, least = HUGE_VAL, most = 0;
  for (Index i = 0; i < q; ++i) {
    const ModelEstimate one = (*this)(rows.transpose() * eigen.eigenvectors().col(i));
    if (!one.t) {
      out.undefined = one.undefined;
      return out;
    }
    sum += *one.t * *one.t;
    excess += *one.df_satterthwaite / (*one.df_satterthwaite - 2);
    least = std::min(least, *one.df_satterthwaite);
    most = std::max(most, *one.df_satterthwaite);
  }
  const auto df = static_cast<double>(q);
  out.num_df = df;
  out.den_df = most - least < 1e-8 * most ? most : least <= 2 ? 2 : 2 * excess / (excess - df);
  out.f = sum / df;
  out.p = f_upper_tail(*out.f, df, *out.den_df);
  return out;
}

}  // namespace palpate::analysis
