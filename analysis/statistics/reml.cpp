#include "analysis/statistics/reml.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace palpate::analysis {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Matrices of a participant at a given Psi.
struct Part {
  MatrixXd k;  // (counts^-1 + Psi)^-1 = Z'V^-1 Z
  MatrixXd f;  // K x = Z'V^-1 X
  VectorXd u;  // K (y - x beta)
};

MatrixXd rows_and_columns(const MatrixXd& all, const std::vector<Index>& which) {
  return all(which, which);
}

/// Row and column in Lambda of each theta (lower triangle by columns).
std::vector<std::pair<Index, Index>> lower_triangle_entries(Index levels) {
  std::vector<std::pair<Index, Index>> out;
  for (Index column = 0; column < levels; ++column) {
    for (Index row = column; row < levels; ++row) out.emplace_back(row, column);
  }
  return out;
}

/// Sums over participants of quadratic forms with E, a direction of Psi at the participant's
/// levels.
struct Sums {
  MatrixXd loss;   // F' E F
  VectorXd mixed;  // F' E u
  double squares;  // u' E u
  double traces;   // tr(E (K - F C F'))
};

void put_derivatives(const RemlStatistics& data, const MatrixXd& coding, const VectorXd& theta,
                     const std::vector<Part>& parts, double y_p_y, RemlPoint& out) {
  const Index q = data.levels, p = out.beta.size();
  const double degrees_of_freedom = data.degrees_of_freedom;
  const MatrixXd lambda = lower_triangle(theta, q);
  const MatrixXd& c = out.inverse_xx;
  const auto entries = lower_triangle_entries(q);
  const std::size_t n_theta = entries.size();

  std::vector<MatrixXd> unit(n_theta), direction(n_theta);  // d Lambda and d Psi by each theta
  for (std::size_t k = 0; k < n_theta; ++k) {
    unit[k] = MatrixXd::Zero(q, q);
    unit[k](entries[k].first, entries[k].second) = 1;
    const MatrixXd half = coding * unit[k] * lambda.transpose() * coding.transpose();
    direction[k] = half + half.transpose();
  }

  out.slope = MatrixXd::Zero(q, q);
  std::vector<Sums> sums(n_theta, {{}, VectorXd::Zero(p), 0, 0});
  MatrixXd second_trace = MatrixXd::Zero(static_cast<Index>(n_theta), static_cast<Index>(n_theta));
  MatrixXd second_squares = second_trace;  // first term of the second derivative of u' E u
  Index n_rows = 0;
  for (const Part& part : parts) n_rows += part.f.rows();
  // F and E F of all participants stacked: one large matrix product is faster than many small ones.
  MatrixXd all_f(n_rows, p);
  std::vector<MatrixXd> all_ef(n_theta, MatrixXd(n_rows, p));
  for (std::size_t i = 0, row = 0; i < parts.size(); row += data.groups[i++].levels.size()) {
    const Part& part = parts[i];
    const auto& levels = data.groups[i].levels;
    const auto rows = Eigen::seqN(static_cast<Index>(row), part.f.rows());
    all_f(rows, Eigen::all) = part.f;
    const MatrixXd fixed = part.f * c * part.f.transpose();
    const MatrixXd gap = part.k - fixed;
    out.slope(levels, levels) += gap - part.u * part.u.transpose() * (degrees_of_freedom / y_p_y);
    std::vector<MatrixXd> e(n_theta), ke(n_theta);
    for (std::size_t k = 0; k < n_theta; ++k) {
      e[k] = rows_and_columns(direction[k], levels);
      ke[k] = part.k * e[k];
      all_ef[k](rows, Eigen::all) = e[k] * part.f;
      sums[k].mixed.noalias() += part.f.transpose() * (e[k] * part.u);
      sums[k].squares += part.u.dot(e[k] * part.u);
      sums[k].traces += gap.cwiseProduct(e[k]).sum();
    }
    for (std::size_t k = 0; k < n_theta; ++k) {
      for (std::size_t l = 0; l <= k; ++l) {
        const auto a = static_cast<Index>(k), b = static_cast<Index>(l);
        second_trace(a, b) += -(ke[k].transpose().cwiseProduct(ke[l])).sum() +
                              2 * fixed.cwiseProduct(e[k] * ke[l]).sum();
        second_squares(a, b) -= 2 * part.u.dot(e[k] * (ke[l] * part.u));
      }
    }
  }

  const auto m = static_cast<Index>(n_theta);
  out.gradient.resize(m);
  out.hessian.resize(m, m);
  out.full_hessian.resize(m + 1, m + 1);
  std::vector<MatrixXd> c_loss(n_theta);
  for (std::size_t k = 0; k < n_theta; ++k) {
    sums[k].loss.noalias() = all_f.transpose() * all_ef[k];
    c_loss[k].noalias() = c * sums[k].loss;
  }
  const double sigma = std::sqrt(out.sigma_squared);
  for (std::size_t k = 0; k < n_theta; ++k) {
    const auto a = static_cast<Index>(k);
    out.gradient(a) = sums[k].traces - degrees_of_freedom * sums[k].squares / y_p_y;
    for (std::size_t l = 0; l <= k; ++l) {
      const auto b = static_cast<Index>(l);
      const double traces =
          second_trace(a, b) - c_loss[k].transpose().cwiseProduct(c_loss[l]).sum();
      const double squares = second_squares(a, b) + 2 * sums[k].mixed.dot(c * sums[l].mixed);
      const MatrixXd bend = coding *
                            (unit[k] * unit[l].transpose() + unit[l] * unit[k].transpose()) *
                            coding.transpose();
      const double curved = out.slope.cwiseProduct(bend).sum();
      out.full_hessian(a, b) = out.full_hessian(b, a) =
          traces - squares / out.sigma_squared + curved;
      out.hessian(a, b) = out.hessian(b, a) =
          traces -
          degrees_of_freedom *
              (squares / y_p_y + sums[k].squares * sums[l].squares / y_p_y / y_p_y) +
          curved;
    }
    out.full_hessian(a, m) = out.full_hessian(m, a) =
        2 * sums[k].squares / (sigma * out.sigma_squared);
  }
  out.full_hessian(m, m) = 4 * degrees_of_freedom / out.sigma_squared;
  for (Sums& sum : sums) out.information_loss.push_back(std::move(sum.loss));
}

}  // namespace

MatrixXd lower_triangle(const VectorXd& theta, Index levels) {
  MatrixXd lambda = MatrixXd::Zero(levels, levels);
  Index k = 0;
  for (const auto& [row, column] : lower_triangle_entries(levels)) lambda(row, column) = theta(k++);
  return lambda;
}

RemlPoint reml_point(const RemlStatistics& data, const MatrixXd& coding, const VectorXd& theta,
                     bool with_derivatives) {
  const MatrixXd half = coding * lower_triangle(theta, data.levels);
  const MatrixXd psi = half * half.transpose();
  const Index p = data.within.size();
  const double degrees_of_freedom = data.degrees_of_freedom;

  RemlPoint out;
  std::vector<Part> parts(data.groups.size());
  MatrixXd xx = data.within.asDiagonal();
  VectorXd xy = data.xy;
  double log_determinant = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const RemlParticipant& group = data.groups[i];
    // counts^-1 + Psi = D^-1/2 (1 + D^1/2 Psi D^1/2) D^-1/2 is well conditioned for any Psi, also
    // 0.
    const VectorXd root = group.counts.cwiseSqrt();
    MatrixXd inner = root.asDiagonal() * rows_and_columns(psi, group.levels) * root.asDiagonal();
    inner.diagonal().array() += 1;
    const Eigen::LLT<MatrixXd> factor(inner);
    log_determinant += 2 * factor.matrixLLT().diagonal().array().log().sum();
    const MatrixXd whitened = factor.matrixL().solve(MatrixXd(root.asDiagonal()));
    parts[i].k = whitened.transpose() * whitened;
    parts[i].f = parts[i].k * group.x;
    xx.noalias() += group.x.transpose() * parts[i].f;
    xy.noalias() += parts[i].f.transpose() * group.y;
  }
  const Eigen::LLT<MatrixXd> factor(xx);
  out.beta = factor.solve(xy);
  double y_p_y =
      data.yy - 2 * out.beta.dot(data.xy) + out.beta.dot(data.within.cwiseProduct(out.beta));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const VectorXd rest = data.groups[i].y - data.groups[i].x * out.beta;
    parts[i].u = parts[i].k * rest;
    y_p_y += rest.dot(parts[i].u);
  }
  out.sigma_squared = y_p_y / degrees_of_freedom;
  out.deviance = log_determinant + 2 * factor.matrixLLT().diagonal().array().log().sum() +
                 degrees_of_freedom * (1 + std::log(2 * std::numbers::pi * out.sigma_squared));
  if (with_derivatives) {
    out.inverse_xx = factor.solve(MatrixXd::Identity(p, p));
    put_derivatives(data, coding, theta, parts, y_p_y, out);
  }
  return out;
}

}  // namespace palpate::analysis
