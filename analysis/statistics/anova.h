#pragma once
// Common parts of analyses of variance.

#include <Eigen/Core>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>

namespace palpate::analysis {

inline constexpr double kNoVariance = 1e-10;  ///< relative to the mean, as for the paired tests
/// Relative to the largest figure: fitted figures are no more exact, and no effect is as small.
inline constexpr double kFigureNoise = 1e-7;

/// Orthonormal Helmert contrasts of `levels`, one a row, each summing to 0.
inline Eigen::MatrixXd helmert_contrasts(Eigen::Index levels) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(levels - 1, levels);
  for (Eigen::Index i = 0; i + 1 < levels; ++i) {
    const auto before = static_cast<double>(i + 1);
    rows.row(i).head(i + 1).setConstant(1 / std::sqrt(before * (before + 1)));
    rows(i, i + 1) = -before / std::sqrt(before * (before + 1));
  }
  return rows;
}

/// One row: the mean of `levels`, of unit length.
inline Eigen::MatrixXd unit_average(Eigen::Index levels) {
  return Eigen::MatrixXd::Constant(1, levels, 1 / std::sqrt(static_cast<double>(levels)));
}

/// The Kronecker product.
inline Eigen::MatrixXd kronecker(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd out(a.rows() * b.rows(), a.cols() * b.cols());
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.cols(); ++j)
      out.block(i * b.rows(), j * b.cols(), b.rows(), b.cols()) = a(i, j) * b;
  }
  return out;
}

/// The p of an F.
inline double f_upper_tail(double f, double num_df, double den_df) {
  return cdf(complement(boost::math::fisher_f(num_df, den_df), f));
}

}  // namespace palpate::analysis
