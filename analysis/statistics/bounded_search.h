#pragma once
// Minima of smooth functions within bounds.

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

namespace palpate::analysis {

/// Value at a place; sets the gradient.
using Objective = std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>;

struct Minimum {
  Eigen::VectorXd place;
  double value = std::numeric_limits<double>::infinity();
};

struct Bounds {
  Eigen::VectorXd low, high;
  Eigen::VectorXd clamped(const Eigen::VectorXd& x) const { return x.cwiseMax(low).cwiseMin(high); }
};

/// The least of the minima from several starts.
Minimum best_of(const Objective& objective, const std::vector<Eigen::VectorXd>& starts,
                const Bounds& bounds);

}  // namespace palpate::analysis
