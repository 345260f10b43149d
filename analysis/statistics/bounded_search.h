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

/// A local minimum within bounds: Broyden, Fletcher, Goldfarb & Shanno's method with steps
/// projected on the bounds. A place where a bound is met and the gradient is zero is a minimum:
/// start off the bounds.
Minimum minimize_within(const Objective& objective, const Eigen::VectorXd& start,
                        const Bounds& bounds);

/// The least of the minima from several starts.
Minimum best_of(const Objective& objective, const std::vector<Eigen::VectorXd>& starts,
                const Bounds& bounds);

}  // namespace palpate::analysis
