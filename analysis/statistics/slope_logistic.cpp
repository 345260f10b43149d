#include "analysis/statistics/slope_logistic.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/statistics/bounded_search.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMostSd = 20;

double half_of(const RenderedAnswers& one) { return one.compared ? 0.5 : -0.5; }

// Parameters: the log odds ratio, the shapes, and the SDs of level and effect.

Index level_sd(const VectorXd& x) { return x.size() - 2; }
Index effect_sd(const VectorXd& x) { return x.size() - 1; }
Index index_of_shape(const RenderedAnswers& one) { return 1 + static_cast<Index>(one.shape); }

/// Log likelihood of a cell's answers, chance of a correct one, and what the trials say beyond it.
struct Answered {
  double log_likelihood = 0, p = 0, residual = 0, weight = 0;
};

Answered answered(const RenderedAnswers& one, double eta) {
  const double small = std::exp(-std::abs(eta)), sum = 1 + small;
  Answered out;
  out.p = (eta < 0 ? small : 1) / sum;
  out.log_likelihood = one.correct * eta - one.trials * (std::max(eta, 0.0) + std::log(sum));
  out.residual = one.correct - one.trials * out.p;
  out.weight = one.trials * small / (sum * sum);
  return out;
}

/// Log density of a participant's answers and effects at the standardised effects (u, s), with its
/// slope and minus its second derivatives.
struct Joint {
  double value = 0, by_u = 0, by_s = 0, uu = 1, us = 0, ss = 1;

  double determinant() const { return uu * ss - us * us; }
};

Joint joint_at(const std::vector<RenderedAnswers>& answers, const VectorXd& x, double u, double s) {
  const double tau = x[level_sd(x)], omega = x[effect_sd(x)];
  Joint out;
  out.value = -0.5 * (u * u + s * s);
  out.by_u = -u;
  out.by_s = -s;
  for (const RenderedAnswers& one : answers) {
    const double r = half_of(one);
    const Answered at = answered(one, x[0] * r + x[index_of_shape(one)] + tau * u + omega * r * s);
    out.value += at.log_likelihood;
    out.by_u += at.residual * tau;
    out.by_s += at.residual * omega * r;
    out.uu += at.weight * tau * tau;
    out.us += at.weight * tau * omega * r;
    out.ss += at.weight * omega * omega * r * r;
  }
  return out;
}

struct Mode {
  double u = 0, s = 0;
  Joint joint;
};

/// The most likely effects, by Newton's method with halved steps. \param mode  where to begin
void find_mode(const std::vector<RenderedAnswers>& answers, const VectorXd& x, Mode& mode) {
  mode.joint = joint_at(answers, x, mode.u, mode.s);
  for (int i = 0; i < 100; ++i) {
    const Joint& at = mode.joint;
    const double du = (at.ss * at.by_u - at.us * at.by_s) / at.determinant();
    const double ds = (at.uu * at.by_s - at.us * at.by_u) / at.determinant();
    double length = 1;
    Joint next = joint_at(answers, x, mode.u + du, mode.s + ds);
    // Near the mode values differ by rounding only.
    const double least = mode.joint.value - 1e-12 * (1 + std::abs(mode.joint.value));
    while (!(next.value >= least) && length > 1e-8) {
      length *= 0.5;
      next = joint_at(answers, x, mode.u + length * du, mode.s + length * ds);
    }
    // A step is as wrong as the square of its size: after one of 1e-7 nothing is left to gain.
    const bool near = std::hypot(du, ds) < 1e-7 * (1 + std::hypot(mode.u, mode.s));
    mode = {mode.u + length * du, mode.s + length * ds, next};
    if (near) break;
  }
}

/// Laplace's approximation of the log likelihood, log joint - log det H / 2 at the mode. Its
/// gradient has the move of the mode with the parameters in the term of H.
double laplace(const std::vector<RenderedAnswers>& answers, const VectorXd& x, Mode& mode,
               VectorXd& gradient) {
  find_mode(answers, x, mode);
  const Joint& h = mode.joint;
  const double tau = x[level_sd(x)], omega = x[effect_sd(x)], determinant = h.determinant();
  const double vuu = h.ss / determinant, vus = -h.us / determinant, vss = h.uu / determinant;
  const auto at_mode = [&](const RenderedAnswers& one) {
    const double r = half_of(one);
    return answered(one, x[0] * r + x[index_of_shape(one)] + tau * mode.u + omega * r * mode.s);
  };
  // Change of the trace of log H by the predictor of a cell, summed over how the mode moves it.
  double ku = 0, ks = 0;
  for (const RenderedAnswers& one : answers) {
    const Answered at = at_mode(one);
    const double a = tau, b = omega * half_of(one);
    const double q = a * a * vuu + 2 * a * b * vus + b * b * vss;
    const double third = at.weight * (1 - 2 * at.p) * q;
    ku += third * a;
    ks += third * b;
  }
  const double mu = vuu * ku + vus * ks, ms = vus * ku + vss * ks;
  for (const RenderedAnswers& one : answers) {
    const Answered at = at_mode(one);
    const double r = half_of(one), a = tau, b = omega * r;
    const double q = a * a * vuu + 2 * a * b * vus + b * b * vss;
    const double by_eta =
        at.residual - 0.5 * at.weight * (1 - 2 * at.p) * q + 0.5 * at.weight * (mu * a + ms * b);
    gradient[0] += by_eta * r;
    gradient[index_of_shape(one)] += by_eta;
    gradient[level_sd(x)] +=
        by_eta * mode.u - 0.5 * at.residual * mu - at.weight * (a * vuu + b * vus);
    gradient[effect_sd(x)] +=
        r * (by_eta * mode.s - 0.5 * at.residual * ms - at.weight * (a * vus + b * vss));
  }
  return h.value - 0.5 * std::log(determinant);
}

Objective loss_of(const std::vector<std::vector<RenderedAnswers>>& participants) {
  // Each mode is near that of the last place.
  return [&participants, modes = std::vector<Mode>(participants.size())](
             const VectorXd& x, VectorXd& gradient) mutable {
    gradient.setZero();
    double sum = 0;
    for (std::size_t i = 0; i < participants.size(); ++i)
      sum -= laplace(participants[i], x, modes[i], gradient);
    gradient = -gradient;
    return sum;
  };
}

Bounds bounds_of(Index size) {
  Bounds bounds{VectorXd::Constant(size, -4 * kMostLogOdds),
                VectorXd::Constant(size, 4 * kMostLogOdds)};
  // The likelihood is even in both SDs. A bound at 0 would stop a search where the slope is 0.
  bounds.low.tail(2).setConstant(-kMostSd);
  bounds.high.tail(2).setConstant(kMostSd);
  return bounds;
}

}  // namespace

SlopeLogistic::SlopeLogistic(const std::vector<RenderedAnswers>& answers) {
  for (const RenderedAnswers& one : answers) {
    if (one.trials == 0) continue;
    participants_.resize(std::max(participants_.size(), one.participant + 1));
    participants_[one.participant].push_back(one);
    shapes_ = std::max(shapes_, one.shape + 1);
  }
  const auto size = static_cast<Index>(shapes_ + 3);
  std::vector<VectorXd> starts;
  // The gradient by an SD of 0 is zero: start from several others.
  for (const auto& [level, effect] :
       {std::pair{0.5, 0.5}, std::pair{1.0, 0.1}, std::pair{0.5, 1.5}}) {
    starts.emplace_back(VectorXd::Zero(size));
    starts.back()[size - 2] = level;
    starts.back()[size - 1] = effect;
  }
  const Minimum found = best_of(loss_of(participants_), starts, bounds_of(size));
  place_.assign(found.place.begin(), found.place.end());
  best_ = {found.place[0],
           {std::abs(found.place[size - 2]), std::abs(found.place[size - 1])},
           {place_.begin() + 1, place_.end() - 2},
           -found.value};
}

double SlopeLogistic::likelihood_ratio(double log_odds_ratio) const {
  const auto size = static_cast<Index>(place_.size());
  Bounds bounds = bounds_of(size);
  bounds.low[0] = bounds.high[0] = log_odds_ratio;
  VectorXd start = Eigen::Map<const VectorXd>(place_.data(), size);
  start[0] = log_odds_ratio;
  start[size - 2] = std::max(std::abs(start[size - 2]), 0.2);
  // An effect of the participants in the place of the held one.
  VectorXd wide = start;
  start[size - 1] = std::max(std::abs(start[size - 1]), 0.2);
  wide[size - 1] = std::hypot(start[size - 1], log_odds_ratio - best_.log_odds_ratio);
  const Minimum found = best_of(loss_of(participants_), {start, wide}, bounds);
  return std::max(0.0, 2 * (best_.log_likelihood + found.value));
}

}  // namespace palpate::analysis
