#pragma once
// What the REML criterion needs of participants' cells, in as few columns as the data allow.

#include <Eigen/Dense>
#include <cstddef>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/reml.h"

namespace palpate::analysis {

/// The non-empty cells are the columns of X: any coding of renderer * shape spans the same.
struct ModelCells {
  std::vector<std::size_t> renderers, shapes;  ///< those with a time, in order
  /// [renderer][shape] of these: column of X, -1 for an empty cell. Those of a renderer adjoin.
  std::vector<std::vector<Eigen::Index>> column;
  Eigen::Index n = 0;
};

ModelCells model_cells(const People& people);

/// Directions of one renderer's cells.
struct CellDirections {
  Eigen::Index first_cell = 0, first_column = 0;  ///< where its cells and columns begin
  Eigen::MatrixXd directions;                     ///< cells x columns, orthonormal
};

/// Everything that the criterion needs, from one pass over participants' cells.
///
/// With D the trials of each cell and c the cells' means, X'V^-1X = D - (one direction for each
/// participant and renderer): only what lies in the span of these directions depends on Psi. The
/// columns of `data` are an orthonormal basis of that span, of D^1/2 c; across it the estimate is
/// the plain mean with variance sigma^2 / D. So a balanced study of any number of shapes has one
/// column for each renderer, and none has more than there are cells or participants x renderers.
class ModelData {
 public:
  ModelData(const People& people, const ModelCells& cells);

  RemlData data;
  double freedom = 0;       ///< trials less the rank of X and Z together
  double least_square = 0;  ///< residual sum of squares with participants as fixed effects
  double scale = 0;         ///< largest |mean log|
  bool shared = true;       ///< every pair of renderers has a participant who has both

  /// log |D|: what |X'V^-1X| of the cells is larger by than that of the columns.
  double log_determinant() const { return counts_.array().log().sum(); }
  /// Best estimates of the cells' mean log times.
  Eigen::VectorXd cell_means(const Eigen::VectorXd& beta) const;
  /// For the variance of weights' c: that of the columns' estimates loaded with `inside`, and
  /// sigma^2 times `outside`.
  struct Loading {
    Eigen::VectorXd inside;
    double outside = 0;
  };
  Loading load(const Eigen::VectorXd& weights) const;

 private:
  Eigen::VectorXd to_columns(const Eigen::VectorXd& scaled) const;
  Eigen::VectorXd to_cells(const Eigen::VectorXd& columns) const;

  std::vector<CellDirections> blocks_;
  Eigen::VectorXd counts_, centre_;  ///< by cell: trials; what was subtracted from y
};

}  // namespace palpate::analysis
