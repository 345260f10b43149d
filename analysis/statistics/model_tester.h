#pragma once
// Tests on the cell means of a fitted linear mixed model.

#include <Eigen/Dense>
#include <string>

#include "analysis/statistics/mixed_anova.h"
#include "analysis/statistics/model_estimate.h"
#include "analysis/statistics/reml.h"

namespace palpate::analysis {

/// Estimates and tests linear combinations of the cell means.
class ModelTester {
 public:
  /// \param data, point  must outlive it
  ModelTester(const ReducedModel& data, const RemlPoint& point);

  /// Degrees of freedom of Satterthwaite (1946) as in lmerTest (Kuznetsova et al. 2017): 2 v^2 /
  /// var(v), with var(v) by the delta method from the Hessian of the deviance in (theta, sigma).
  /// \param weights  of the cells, in the order of the model's
  ModelEstimate operator()(const Eigen::VectorXd& weights) const;

  /// F test that combinations are 0, one a row, with the degrees of freedom of Fai & Cornelius
  /// (1996) as in lmerTest.
  GroupEffect joint(const Eigen::MatrixXd& rows, std::string name) const;

 private:
  const ReducedModel& data_;
  const RemlPoint& point_;
  Eigen::VectorXd means_;
  Eigen::MatrixXd spread_;
};

}  // namespace palpate::analysis
