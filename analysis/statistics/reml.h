#pragma once
// The REML criterion of a linear mixed model whose random effects are one value for each
// participant and level of one factor (here the renderer), with exact derivatives; and its optimum.
//
// y = X beta + Z b + e, b ~ N(0, sigma^2 Psi) for each participant, e ~ N(0, sigma^2). Z has a
// column for each level, so what a participant says about b are the means of y and X at each level:
// the rest of the trials (their deviations from these means) enters through sums that do not depend
// on Psi. An evaluation costs O(participants x columns^2 + columns^3), whatever the number of
// trials.

#include <Eigen/Dense>
#include <vector>

namespace palpate::analysis {

/// A participant's means at the levels that there are trials of.
struct RemlGroup {
  std::vector<Eigen::Index> levels;
  Eigen::VectorXd counts;  ///< trials at each of them, > 0
  Eigen::MatrixXd x;       ///< means of the rows of X, one row a level
  Eigen::VectorXd y;       ///< means of y
};

struct RemlData {
  Eigen::Index levels = 0;  ///< q
  double freedom = 0;       ///< trials less all fixed effects, also those without a column here
  Eigen::VectorXd within;   ///< X'X of the deviations from the means, made diagonal
  Eigen::VectorXd xy;       ///< X'y of them
  double yy = 0;            ///< y'y of them
  std::vector<RemlGroup> groups;
};

/// The criterion, -2 log restricted likelihood with beta and sigma at their best for a given Psi.
struct RemlPoint {
  double deviance = 0;
  double sigma_squared = 0;
  Eigen::VectorXd beta;
  Eigen::MatrixXd inverse_xx;  ///< of X'V^-1 X with V in units of sigma^2; vcov is sigma^2 times it
  Eigen::MatrixXd slope;       ///< derivative by Psi: d deviance = <slope, d Psi>
  Eigen::VectorXd gradient;    ///< by theta
  Eigen::MatrixXd hessian;     ///< by theta
  /// Of -2 log likelihood by (theta, sigma), sigma free.
  Eigen::MatrixXd full_hessian;
  /// Derivative by each theta of -inverse_xx^-1, from which those of vcov follow.
  std::vector<Eigen::MatrixXd> information_loss;
};

/// theta: lower triangle, by columns, of Lambda; Psi = coding Lambda Lambda' coding'. With coding
/// the treatment coding of the levels these are lme4's parameters (Bates et al. 2015).
RemlPoint reml_point(const RemlData& data, const Eigen::MatrixXd& coding,
                     const Eigen::VectorXd& theta, bool with_derivatives);

Eigen::MatrixXd lower_triangle(const Eigen::VectorXd& theta, Eigen::Index levels);

struct RemlOptimum {
  Eigen::VectorXd theta;  ///< diagonal >= 0; exactly 0 on the boundary
  RemlPoint point;
  bool converged = false;  ///< gradient 0 up to rounding and no way down across the boundary
};

/// Newton's method with the Hessian made positive and a line search, from several starts.
RemlOptimum reml_optimum(const RemlData& data, const Eigen::MatrixXd& coding);

}  // namespace palpate::analysis
