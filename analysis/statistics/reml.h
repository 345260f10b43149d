#pragma once
// REML criterion (restricted deviance) of a linear mixed model with a random effect for each
// participant and level of one factor (the renderer), with exact derivatives, and its optimisation.
//
// y = X beta + Z b + e, b ~ N(0, sigma^2 Psi) for each participant, e ~ N(0, sigma^2). Z has a
// column for each level, so a participant's means of y and X at each level are sufficient for Psi;
// the deviations of trials from these means enter through cross-products that do not depend on Psi.
// An evaluation costs O(participants x columns^2 + columns^3), whatever the number of trials.

#include <Eigen/Dense>
#include <vector>

namespace palpate::analysis {

/// A participant's means at the levels with trials.
struct RemlParticipant {
  std::vector<Eigen::Index> levels;
  Eigen::VectorXd counts;  ///< trials at each of them, > 0
  Eigen::MatrixXd x;       ///< means of the rows of X, one row a level
  Eigen::VectorXd y;       ///< means of y
};

/// Sufficient statistics of the data.
struct RemlStatistics {
  Eigen::Index levels = 0;  ///< q
  /// Number of trials - number of all fixed effects, also of those without a column here.
  double degrees_of_freedom = 0;
  Eigen::VectorXd within;  ///< diagonal of X'X of the deviations from the means; the rest is 0
  Eigen::VectorXd xy;      ///< X'y of them
  double yy = 0;           ///< y'y of them
  std::vector<RemlParticipant> groups;
};

/// The criterion at a given Psi: -2 log restricted likelihood, profiled over beta and sigma.
struct RemlPoint {
  double deviance = 0;
  double sigma_squared = 0;
  Eigen::VectorXd beta;
  Eigen::MatrixXd inverse_xx;  ///< of X'V^-1 X with V in units of sigma^2; vcov is sigma^2 times it
  Eigen::MatrixXd slope;       ///< derivative by Psi: d deviance = trace(slope' d Psi)
  Eigen::VectorXd gradient;    ///< of the deviance by theta
  Eigen::MatrixXd hessian;     ///< of the deviance by theta
  /// Hessian of -2 log restricted likelihood by (theta, sigma).
  Eigen::MatrixXd full_hessian;
  /// Derivatives of -inverse_xx^-1 by each theta, from which those of vcov follow.
  std::vector<Eigen::MatrixXd> information_loss;
};

/// Evaluates the criterion. \param theta lower triangle of Lambda by columns; Psi = coding Lambda
/// Lambda' coding'. With the treatment coding of the levels theta is that of lme4 (Bates et al.
/// 2015).
RemlPoint reml_point(const RemlStatistics& data, const Eigen::MatrixXd& coding,
                     const Eigen::VectorXd& theta, bool with_derivatives);

/// Lambda from theta.
Eigen::MatrixXd lower_triangle(const Eigen::VectorXd& theta, Eigen::Index levels);

/// Minimum of the criterion.
struct RemlOptimum {
  Eigen::VectorXd theta;  ///< diagonal >= 0; exactly 0 on the boundary
  RemlPoint point;
  bool converged = false;  ///< first-order (Karush-Kuhn-Tucker) conditions hold up to rounding
};

/// Newton's method with positive definite Hessian and line search, from several starting values.
RemlOptimum reml_optimum(const RemlStatistics& data, const Eigen::MatrixXd& coding);

}  // namespace palpate::analysis
