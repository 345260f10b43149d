#pragma once
// REML criterion (restricted deviance) of a linear mixed model with a random effect for each
// participant and level of one factor (the renderer), with exact derivatives, and its optimisation.
//
// y = X beta + Z b + e, b ~ N(0, sigma^2 Psi) for each participant, e ~ N(0, sigma^2). Z has a
// column for each level and Psi the rank of the effects that participants differ in, so a
// participant's means of y and X at each level are sufficient for Psi; the deviations of trials
// from these means enter through cross-products that do not depend on Psi. An evaluation costs
// O(participants x columns^2 + columns^3), whatever the number of trials.

#include <Eigen/Dense>
#include <cstddef>
#include <vector>

#include "analysis/statistics/describe.h"

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
  /// Number of trials - number of all fixed effects, including those without a column here.
  double degrees_of_freedom = 0;
  Eigen::VectorXd within;  ///< diagonal of X'X of the deviations from the means; else 0
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
  /// Derivatives of -inverse_xx^-1 by each theta; those of vcov follow from them.
  std::vector<Eigen::MatrixXd> information_loss;
};

/// Lambda from theta.
Eigen::MatrixXd lower_triangle(const Eigen::VectorXd& theta, Eigen::Index effects);

/// Minimum of the criterion.
struct RemlOptimum {
  Eigen::VectorXd theta;  ///< diagonal >= 0; exactly 0 on the boundary
  RemlPoint point;
  bool converged = false;  ///< first-order (Karush-Kuhn-Tucker) conditions hold up to rounding
};

/// Newton's method with positive definite Hessian and line search, from several starting values.
/// \param coding  levels x effects, of full column rank: Psi = coding Lambda Lambda' coding'
RemlOptimum reml_optimum(const RemlStatistics& data, const Eigen::MatrixXd& coding);

/// The non-empty cells of renderer x shape. Their indicators are the columns of X: any full-rank
/// coding spans the same.
struct ModelCells {
  std::vector<std::size_t> renderers, shapes;  ///< indices of those with times, ascending
  /// [renderer][shape], indices into these: column of X, -1 for an empty cell. Columns of a
  /// renderer are contiguous.
  std::vector<std::vector<Eigen::Index>> column;
  Eigen::Index n = 0;  ///< number of columns
};

ModelCells model_cells(const ParticipantCells& participant_cells);

/// Orthonormal basis of the span that depends on Psi, within the cells of one renderer.
struct CellDirections {
  Eigen::Index first_cell = 0,
               first_column = 0;  ///< index of its first cell and of its first column
  Eigen::MatrixXd directions;     ///< cells x columns, orthonormal
};

/// Participants' cells reduced to the sufficient statistics of the REML criterion, with as few
/// columns of X as possible: the part of the model that depends on Psi.
///
/// With D the diagonal matrix of trials by cell, X'V^-1X = D - sum of one rank-1 matrix for each
/// participant and renderer: only components of the cell means in the span of these directions
/// depend on Psi. The columns of `data` are an orthonormal basis of that span in the coordinates
/// D^1/2 (cell means); orthogonally to it the estimate is the mean of the cell, with variance
/// sigma^2 / D. A balanced study with any number of shapes has one column for each renderer; the
/// number of columns is at most that of cells and of participants x renderers.
class ReducedModel {
 public:
  ReducedModel(const ParticipantCells& participant_cells, const ModelCells& cells);

  RemlStatistics data;
  double degrees_of_freedom = 0;  ///< number of trials - rank of [X Z]
  double least_square =
      0;               ///< residual sum of squares with participants x renderers as fixed effects
  double scale = 0;    ///< largest |mean log time| of a cell
  bool shared = true;  ///< every pair of renderers has a participant with both

  /// log |D|: to be added to log |X'V^-1X| of the columns to obtain that of the cells.
  double log_determinant() const { return counts_.array().log().sum(); }
  /// Estimates of the cells' mean log times. \param beta estimates of the columns
  Eigen::VectorXd cell_means(const Eigen::VectorXd& beta) const;
  /// Variance of a linear combination of cell means: inside' vcov(beta) inside + sigma^2 outside.
  struct Loading {
    Eigen::VectorXd inside;
    double outside = 0;
  };
  /// \param weights of the cell means
  Loading load(const Eigen::VectorXd& weights) const;

 private:
  Eigen::VectorXd to_columns(const Eigen::VectorXd& scaled) const;
  Eigen::VectorXd to_cells(const Eigen::VectorXd& columns) const;

  std::vector<CellDirections> blocks_;
  Eigen::VectorXd counts_, centre_;  ///< by cell: trials; centre subtracted from y
};

}  // namespace palpate::analysis
