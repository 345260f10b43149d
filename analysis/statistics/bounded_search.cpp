#include "analysis/statistics/bounded_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Zero where a bound stops the descent.
VectorXd free_part(const VectorXd& x, const VectorXd& gradient, const Bounds& bounds) {
  VectorXd part = gradient;
  for (Index i = 0; i < x.size(); ++i) {
    const bool stopped =
        (x[i] <= bounds.low[i] && gradient[i] >= 0) || (x[i] >= bounds.high[i] && gradient[i] <= 0);
    if (stopped) part[i] = 0;
  }
  return part;
}

void update_inverse(MatrixXd& inverse, const VectorXd& step, const VectorXd& change, bool first) {
  const double curvature = step.dot(change);
  if (!(curvature > 1e-14 * step.norm() * change.norm())) return;
  if (first) inverse *= curvature / change.squaredNorm();
  const VectorXd product = inverse * change;
  const double ratio = (1 + change.dot(product) / curvature) / curvature;
  inverse += ratio * step * step.transpose() -
             (product * step.transpose() + step * product.transpose()) / curvature;
}

/// A local minimum within bounds: Broyden, Fletcher, Goldfarb & Shanno's method with steps
/// projected on the bounds. A place where a bound is met and the gradient is zero is a minimum:
/// start off the bounds.
Minimum minimize_within(const Objective& objective, const VectorXd& start, const Bounds& bounds) {
  Minimum now{bounds.clamped(start), 0};
  const Index n = start.size();
  VectorXd gradient(n), next_gradient(n);
  now.value = objective(now.place, gradient);
  MatrixXd inverse = MatrixXd::Identity(n, n);
  bool first = true;
  for (int i = 0, idle = 0; i < 300 && idle < 2; ++i) {
    const VectorXd free = free_part(now.place, gradient, bounds);
    if (free.lpNorm<Eigen::Infinity>() < 1e-9) break;
    VectorXd direction = -(inverse * free);
    for (Index k = 0; k < n; ++k) {
      if (free[k] == 0) direction[k] = 0;
    }
    if (!(direction.dot(free) < 0)) {
      inverse.setIdentity();
      first = true;
      direction = -free;
    }
    const double most = direction.lpNorm<Eigen::Infinity>();
    if (most > 1) direction /= most;
    double length = 1;
    Minimum next;
    VectorXd step;
    for (int halved = 0; halved < 40; ++halved) {
      next.place = bounds.clamped(now.place + length * direction);
      step = next.place - now.place;
      next.value = objective(next.place, next_gradient);
      const double slope = gradient.dot(step);
      if (next.value <= now.value + 1e-4 * slope) break;
      // The minimum of the parabola through both values and the slope.
      const double share = -slope / (2 * (next.value - now.value - slope));
      length *= std::isfinite(share) ? std::clamp(share, 0.1, 0.5) : 0.1;
    }
    if (!(next.value < now.value)) {
      if (first) break;
      inverse.setIdentity();
      first = true;
      ++idle;
      continue;
    }
    idle = now.value - next.value < 1e-12 * (1 + std::abs(now.value)) ? idle + 1 : 0;
    update_inverse(inverse, step, next_gradient - gradient, first);
    first = false;
    now = next;
    gradient = next_gradient;
  }
  return now;
}

}  // namespace

Minimum best_of(const Objective& objective, const std::vector<VectorXd>& starts,
                const Bounds& bounds) {
  Minimum best;
  for (const VectorXd& start : starts) {
    Minimum one = minimize_within(objective, start, bounds);
    if (one.value < best.value) best = std::move(one);
  }
  return best;
}

}  // namespace palpate::analysis
