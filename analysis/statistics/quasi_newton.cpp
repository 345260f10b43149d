#include "analysis/statistics/quasi_newton.h"

#include <cmath>

namespace palpate::analysis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd numerical_gradient(const SmoothFunction& function, const VectorXd& place) {
  VectorXd gradient(place.size());
  VectorXd moved = place;
  for (Eigen::Index i = 0; i < place.size(); ++i) {
    const double h = 1e-5 * std::max(1.0, std::abs(place[i]));
    moved[i] = place[i] + h;
    const double above = function(moved);
    moved[i] = place[i] - h;
    gradient[i] = (above - function(moved)) / (2 * h);
    moved[i] = place[i];
  }
  return gradient;
}

}  // namespace

VectorXd minimize_smooth(const SmoothFunction& function, VectorXd start) {
  VectorXd place = std::move(start), gradient = numerical_gradient(function, place);
  double value = function(place);
  MatrixXd inverse = MatrixXd::Identity(place.size(), place.size());
  // Differences of the values are known to some 1e-13 of them, and so is what is left to gain.
  const double least_gain = 1e-12 * (1 + std::abs(value));
  for (int i = 0, idle = 0; i < 500 && idle < 2; ++i) {
    VectorXd step = -inverse * gradient;
    if (!(step.dot(gradient) < 0)) {
      inverse.setIdentity();
      step = -gradient;
    }
    if (step.norm() > 5) step *= 5 / step.norm();
    double next = function(place + step);
    for (int halved = 0; !(next <= value + 1e-4 * step.dot(gradient)); ++halved) {
      if (halved == 40) return place;
      step *= 0.5;
      next = function(place + step);
    }
    idle = value - next < least_gain ? idle + 1 : 0;
    place += step;
    const VectorXd changed = numerical_gradient(function, place);
    const VectorXd y = changed - gradient;
    const double curvature = step.dot(y);
    if (curvature > 1e-14) {
      const MatrixXd left =
          MatrixXd::Identity(place.size(), place.size()) - step * y.transpose() / curvature;
      inverse = left * inverse * left.transpose() + step * step.transpose() / curvature;
    }
    gradient = changed;
    value = next;
  }
  return place;
}

MatrixXd numerical_hessian(const SmoothFunction& function, const VectorXd& place) {
  const Eigen::Index n = place.size();
  MatrixXd hessian(n, n);
  const double h = 1e-3;
  const auto at = [&](Eigen::Index i, double a, Eigen::Index j, double b) {
    VectorXd moved = place;
    moved[i] += a;
    moved[j] += b;
    return function(moved);
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      hessian(i, j) = hessian(j, i) =
          (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4 * h * h);
    }
  }
  return hessian;
}

}  // namespace palpate::analysis
