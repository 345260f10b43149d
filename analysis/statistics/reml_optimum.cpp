#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/statistics/reml.h"

namespace palpate::analysis {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxSteps = 200;
// Participants. With more the criterion has been found to have one minimum: two starting values
// check it.
constexpr std::size_t kFew = 500;
constexpr double kOnBoundary = 1e-4;  // threshold of a diagonal theta, as in lme4's isSingular()

/// Lambda's lower triangle with a diagonal >= 0 from any root of Lambda Lambda'.
VectorXd theta_of(const MatrixXd& root) {
  const Index q = root.rows();
  const MatrixXd r =
      MatrixXd(root.transpose()).householderQr().matrixQR().triangularView<Eigen::Upper>();
  VectorXd theta(q * (q + 1) / 2);
  Index k = 0;
  for (Index column = 0; column < q; ++column) {
    const double sign = r(column, column) < 0 ? -1 : 1;
    for (Index row = column; row < q; ++row) theta(k++) = sign * r(column, row);
  }
  return theta;
}

std::vector<Index> diagonal(Index q) {
  std::vector<Index> out;
  for (Index column = 0, k = 0; column < q; k += q - column++) out.push_back(k);
  return out;
}

/// Newton step with the absolute values of the Hessian's eigenvalues: a descent direction.
VectorXd newton_step(const RemlPoint& point) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(point.hessian);
  const VectorXd curvature = eigen.eigenvalues().cwiseAbs();
  const double floor = 1e-10 * std::max(curvature.maxCoeff(), 1e-10);
  return -eigen.eigenvectors() * (eigen.eigenvectors().transpose() * point.gradient)
                                     .cwiseQuotient(curvature.cwiseMax(floor));
}

/// Rounding error of the deviance, larger for large effects with a small residual.
double rounding(const RemlOptimum& at) {
  return std::min(
      1e-6, 1e-13 * std::max(1.0, std::fabs(at.point.deviance)) * (1 + at.theta.squaredNorm()));
}

/// Descends from theta until the gradient vanishes. The criterion is even in a diagonal theta, so a
/// starting value on the boundary stays there.
RemlOptimum descend(const RemlStatistics& data, const MatrixXd& coding, VectorXd theta) {
  RemlOptimum out;
  out.theta = std::move(theta);
  out.point = reml_point(data, coding, out.theta, true);
  for (int i = 0; i < kMaxSteps; ++i) {
    const VectorXd step = newton_step(out.point);
    const double promised = -step.dot(out.point.gradient);
    const double noise = rounding(out);
    const double longest = 1 + out.theta.norm();
    double length = std::min(1.0, longest / step.norm());
    RemlPoint next;
    bool lower = false;
    for (int halved = 0; halved < 40 && !lower; ++halved, length /= 2) {
      next = reml_point(data, coding, out.theta + length * step, true);
      lower = next.deviance <= out.point.deviance - 1e-4 * length * promised + noise;
      if (lower) out.theta += length * step;
    }
    if (!lower) break;
    // Near the minimum the deviance is constant up to rounding: a step is accepted if it reduces
    // the gradient.
    const bool done = promised < noise && next.gradient.norm() >= 0.5 * out.point.gradient.norm();
    out.point = std::move(next);
    if (promised < noise) out.converged = true;
    if (done || promised == 0) break;
  }
  return out;
}

/// Among the directions in which Psi is 0, that of steepest descent; none: the Karush-Kuhn-Tucker
/// conditions hold.
VectorXd way_off_boundary(const RemlOptimum& at, const MatrixXd& coding, Index q) {
  const MatrixXd lambda = lower_triangle(at.theta, q);
  const MatrixXd slope = coding.transpose() * at.point.slope * coding;  // by Lambda Lambda'
  const Eigen::SelfAdjointEigenSolver<MatrixXd> psi(lambda * lambda.transpose());
  std::vector<Index> null;
  for (Index i = 0; i < q; ++i) {
    if (psi.eigenvalues()(i) <= kOnBoundary * kOnBoundary) null.push_back(i);
  }
  if (null.empty()) return VectorXd::Zero(q);
  const MatrixXd basis = psi.eigenvectors()(Eigen::all, null);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> reduced(basis.transpose() * slope * basis);
  const double scale = 1e-9 * std::max(1.0, slope.norm());
  if (reduced.eigenvalues()(0) >= -scale) return VectorXd::Zero(q);
  return basis * reduced.eigenvectors().col(0);
}

VectorXd with_small_diagonals_at_zero(VectorXd theta, Index q) {
  for (const Index k : diagonal(q)) {
    if (std::fabs(theta(k)) < kOnBoundary) theta(k) = 0;
  }
  return theta;
}

/// descend(), then leaves the boundary where that lowers the deviance, and sets parameters near 0
/// to exactly 0.
RemlOptimum optimum_from(const RemlStatistics& data, const MatrixXd& coding,
                         const VectorXd& start) {
  const Index q = data.levels;
  RemlOptimum best = descend(data, coding, start);
  for (int i = 0; i < 10; ++i) {
    best.theta = theta_of(lower_triangle(best.theta, q));
    const VectorXd snapped = with_small_diagonals_at_zero(best.theta, q);
    if (snapped != best.theta || !best.converged) {
      RemlOptimum on = descend(data, coding, snapped);
      if (on.point.deviance <= best.point.deviance + 1e-8) best = std::move(on);
    }
    const VectorXd away = way_off_boundary(best, coding, q);
    if (away.isZero(0)) break;
    MatrixXd root(q, q + 1);
    root << lower_triangle(best.theta, q), 0.1 * away;
    RemlOptimum off = descend(data, coding, theta_of(root));
    if (off.point.deviance >= best.point.deviance) break;
    best = std::move(off);
  }
  // theta_of() again: a step may have changed the sign of a diagonal.
  best.theta = theta_of(lower_triangle(best.theta, q));
  for (const Index k : diagonal(q)) best.theta(k) = std::fabs(best.theta(k));
  best.point = reml_point(data, coding, best.theta, true);
  best.converged = best.converged && way_off_boundary(best, coding, q).isZero(0);
  return best;
}

/// Moment estimate of Psi: covariance of participants' means minus the part of residual variance.
MatrixXd by_moments(const RemlStatistics& data) {
  const Index q = data.levels;
  const RemlPoint flat =
      reml_point(data, MatrixXd::Identity(q, q), VectorXd::Zero(q * (q + 1) / 2), false);
  const double within = std::max(1e-300, (data.yy - 2 * flat.beta.dot(data.xy) +
                                          flat.beta.dot(data.within.cwiseProduct(flat.beta))) /
                                             std::max(1.0, data.degrees_of_freedom));
  MatrixXd products = MatrixXd::Zero(q, q), pairs = products, noise = products;
  for (const RemlParticipant& group : data.groups) {
    const VectorXd rest = group.y - group.x * flat.beta;
    products(group.levels, group.levels) += rest * rest.transpose();
    pairs(group.levels, group.levels).array() += 1;
    for (Index i = 0; i < group.counts.size(); ++i) {
      const Index level = group.levels[static_cast<std::size_t>(i)];
      noise(level, level) += 1 / group.counts(i);
    }
  }
  const MatrixXd raw = (products / within - noise).cwiseQuotient(pairs.cwiseMax(1));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(raw);
  const double floor = 1e-3 * std::max(eigen.eigenvalues().maxCoeff(), 1e-2);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(floor).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

RemlOptimum reml_optimum(const RemlStatistics& data, const MatrixXd& coding) {
  const Index q = data.levels;
  const MatrixXd inverse = coding.inverse();
  const MatrixXd moments = inverse * by_moments(data) * inverse.transpose();
  const VectorXd first = theta_of(moments.llt().matrixL());
  std::vector<VectorXd> starts{first};
  starts.push_back(theta_of(MatrixXd::Identity(q, q)));  // starting value of lme4
  if (data.groups.size() <= kFew) {
    starts.push_back(theta_of(0.1 * MatrixXd::Identity(q, q)));
    MatrixXd turned = lower_triangle(first, q);  // correlations with the opposite sign
    turned.triangularView<Eigen::StrictlyLower>() *= -1;
    starts.push_back(theta_of(turned));
  }
  RemlOptimum best;
  best.point.deviance = std::numeric_limits<double>::infinity();
  for (const VectorXd& start : starts) {
    RemlOptimum found = optimum_from(data, coding, start);
    const bool better = found.point.deviance < best.point.deviance - 1e-9;
    if (better ||
        (found.converged && !best.converged && found.point.deviance < best.point.deviance + 1e-9)) {
      best = std::move(found);
    }
  }
  return best;
}

}  // namespace palpate::analysis
