#pragma once

#include <Eigen/Dense>
#include <functional>

namespace palpate::analysis {

using SmoothFunction = std::function<double(const Eigen::VectorXd&)>;

/// A local minimum of a smooth function by Broyden, Fletcher, Goldfarb & Shanno's method, with
/// central differences for its gradient.
Eigen::VectorXd minimize_smooth(const SmoothFunction& function, Eigen::VectorXd start);

/// Second derivatives by central differences.
Eigen::MatrixXd numerical_hessian(const SmoothFunction& function, const Eigen::VectorXd& place);

}  // namespace palpate::analysis
