#include "analysis/statistics/mixed_logistic.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

namespace palpate::analysis {

using SmoothFunction = std::function<double(const Eigen::VectorXd&)>;

/// A local minimum of a smooth function by Broyden, Fletcher, Goldfarb & Shanno's method, with
/// central differences for its gradient.
Eigen::VectorXd minimize_smooth(const SmoothFunction& function, Eigen::VectorXd start);

/// Second derivatives by central differences.
Eigen::MatrixXd numerical_hessian(const SmoothFunction& function, const Eigen::VectorXd& place);

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
  // Values are exact to about 1e-13 of their size, which limits the detectable gain.
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

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double log1pexp(double x) { return x > 0 ? x + std::log1p(std::exp(-x)) : std::log1p(std::exp(x)); }

/// Cells of one participant.
struct Cluster {
  MatrixXd fixed, random;
  VectorXd trials, successes;
};

/// Log density of answers and effects at u, with the matrix of second derivatives.
struct Joint {
  double value = 0;
  VectorXd gradient;
  MatrixXd information;
};

Joint joint_at(const Cluster& cluster, const VectorXd& offset, const MatrixXd& scaled,
               const VectorXd& u) {
  const VectorXd eta = offset + scaled * u;
  Joint joint;
  joint.value = -0.5 * u.squaredNorm();
  VectorXd residual(eta.size()), weight(eta.size());
  for (Eigen::Index i = 0; i < eta.size(); ++i) {
    const double p = 1 / (1 + std::exp(-eta[i]));
    joint.value += cluster.successes[i] * eta[i] - cluster.trials[i] * log1pexp(eta[i]);
    residual[i] = cluster.successes[i] - cluster.trials[i] * p;
    weight[i] = cluster.trials[i] * p * (1 - p);
  }
  joint.gradient = scaled.transpose() * residual - u;
  joint.information =
      scaled.transpose() * weight.asDiagonal() * scaled + MatrixXd::Identity(u.size(), u.size());
  return joint;
}

/// Laplace's approximation of the log likelihood of a participant.
double laplace(const Cluster& cluster, const VectorXd& beta, const MatrixXd& factor) {
  const VectorXd offset = cluster.fixed * beta;
  const MatrixXd scaled = cluster.random * factor;
  VectorXd u = VectorXd::Zero(factor.cols());
  Joint joint = joint_at(cluster, offset, scaled, u);
  for (int i = 0; i < 100; ++i) {
    const VectorXd step = joint.information.ldlt().solve(joint.gradient);
    if (step.norm() < 1e-11 * (1 + u.norm())) break;
    double length = 1;
    Joint next = joint_at(cluster, offset, scaled, u + step);
    while (!(next.value >= joint.value) && length > 1e-8) {
      length *= 0.5;
      next = joint_at(cluster, offset, scaled, u + length * step);
    }
    u += length * step;
    joint = next;
  }
  return joint.value - 0.5 * std::log(joint.information.determinant());
}

/// Lower triangle: one or two standard deviations and the parameter of their correlation.
MatrixXd factor_of(const VectorXd& parameters, Eigen::Index effects) {
  MatrixXd factor = MatrixXd::Zero(effects, effects);
  factor(0, 0) = parameters[0];
  if (effects == 2) {
    factor(1, 0) = parameters[1];
    factor(1, 1) = parameters[2];
  }
  return factor;
}

std::vector<Cluster> clusters_of(const std::vector<BinomialCell>& cells) {
  std::map<std::size_t, std::vector<const BinomialCell*>> by_participant;
  for (const BinomialCell& cell : cells) {
    if (cell.trials > 0) by_participant[cell.participant].push_back(&cell);
  }
  std::vector<Cluster> clusters;
  for (const auto& [participant, own] : by_participant) {
    const auto rows = static_cast<Eigen::Index>(own.size());
    Cluster cluster{MatrixXd(rows, static_cast<Eigen::Index>(own[0]->fixed.size())),
                    MatrixXd(rows, static_cast<Eigen::Index>(own[0]->random.size())),
                    VectorXd(rows), VectorXd(rows)};
    for (Eigen::Index i = 0; i < rows; ++i) {
      const BinomialCell& cell = *own[static_cast<std::size_t>(i)];
      for (Eigen::Index j = 0; j < cluster.fixed.cols(); ++j)
        cluster.fixed(i, j) = cell.fixed[static_cast<std::size_t>(j)];
      for (Eigen::Index j = 0; j < cluster.random.cols(); ++j)
        cluster.random(i, j) = cell.random[static_cast<std::size_t>(j)];
      cluster.trials[i] = cell.trials;
      cluster.successes[i] = cell.successes;
    }
    clusters.push_back(std::move(cluster));
  }
  return clusters;
}

std::string reason_without_model(const std::vector<Cluster>& clusters) {
  if (clusters.size() < 2) return "fewer than two participants";
  double trials = 0, successes = 0;
  MatrixXd products = MatrixXd::Zero(clusters[0].fixed.cols(), clusters[0].fixed.cols());
  for (const Cluster& cluster : clusters) {
    trials += cluster.trials.sum();
    successes += cluster.successes.sum();
    products += cluster.fixed.transpose() * cluster.fixed;
  }
  if (successes == 0 || successes == trials) return "all answers are alike";
  if (products.fullPivLu().rank() < products.rows())
    return "the predictors depend on each other: a combination of levels has no trials";
  return "";
}

void fill_coefficients(MixedLogistic& model, const std::vector<std::string>& names,
                       const VectorXd& beta, const MatrixXd& covariance) {
  for (Eigen::Index i = 0; i < beta.size(); ++i) {
    LogisticCoefficient c;
    c.name = names[static_cast<std::size_t>(i)];
    c.estimate = beta[i];
    c.se = std::sqrt(std::max(0.0, covariance(i, i)));
    c.z = c.estimate / c.se;
    c.p = 2 * cdf(complement(boost::math::normal(), std::abs(c.z)));
    c.ci95 = {c.estimate - 1.959963984540054 * c.se, c.estimate + 1.959963984540054 * c.se};
    model.coefficients.push_back(c);
  }
}

void fill_variances(MixedLogistic& model, const MatrixXd& factor) {
  const MatrixXd covariance = factor * factor.transpose();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    model.random_sds.push_back(std::sqrt(covariance(i, i)));
  constexpr double kZero = 1e-3;  // log odds
  for (Eigen::Index i = 0; i < factor.rows(); ++i) model.singular |= std::abs(factor(i, i)) < kZero;
  if (factor.rows() == 2 && model.random_sds[0] > kZero && model.random_sds[1] > kZero)
    model.random_correlation = covariance(1, 0) / model.random_sds[0] / model.random_sds[1];
}

}  // namespace

MixedLogistic mixed_logistic(const std::vector<BinomialCell>& cells,
                             const std::vector<std::string>& names) {
  MixedLogistic model;
  const std::vector<Cluster> clusters = clusters_of(cells);
  model.participants = clusters.size();
  for (const Cluster& cluster : clusters)
    model.trials += static_cast<std::size_t>(cluster.trials.sum());
  model.undefined = reason_without_model(clusters);
  if (!model.undefined.empty()) return model;
  const Eigen::Index fixed = clusters[0].fixed.cols(), effects = clusters[0].random.cols();
  const Eigen::Index spreads = effects * (effects + 1) / 2;
  const auto loss = [&](const VectorXd& x) {
    const MatrixXd factor = factor_of(x.tail(spreads), effects);
    double sum = 0;
    for (const Cluster& cluster : clusters) sum -= laplace(cluster, x.head(fixed), factor);
    return sum;
  };
  VectorXd start = VectorXd::Zero(fixed + spreads);
  start[fixed] = 0.5;
  if (effects == 2) start[fixed + 2] = 0.5;
  const VectorXd best = minimize_smooth(loss, start);
  // Perfect separation by a predictor has no finite odds.
  if (best.head(fixed).cwiseAbs().maxCoeff() > 12) {
    model.undefined = "a level has no wrong or no correct answers: its odds are infinite";
    return model;
  }
  const MatrixXd hessian = numerical_hessian(loss, best);
  // On the boundary only the block of fixed effects is regular.
  const MatrixXd factor = factor_of(best.tail(spreads), effects);
  fill_variances(model, factor);
  const MatrixXd covariance = model.singular
                                  ? MatrixXd(hessian.topLeftCorner(fixed, fixed).inverse())
                                  : MatrixXd(hessian.inverse());
  model.log_likelihood = -loss(best);
  fill_coefficients(model, names, best.head(fixed), covariance);
  return model;
}

MixedLogistic accuracy_model(const TrialTable& table) {
  std::vector<std::string> names{"(Intercept)"};
  for (std::size_t r = 1; r < table.renderers.size(); ++r)
    names.push_back("renderer" + table.renderers[r]);
  for (std::size_t s = 1; s < table.shapes.size(); ++s) names.push_back("shape" + table.shapes[s]);
  std::map<std::tuple<std::uint32_t, std::uint16_t, std::uint16_t>, BinomialCell> cells;
  for (const TrialRow& row : table.rows) {
    BinomialCell& cell = cells[{row.participant, row.renderer, row.shape}];
    cell.trials += 1;
    cell.successes += row.correct ? 1 : 0;
  }
  std::vector<BinomialCell> list;
  for (auto& [key, cell] : cells) {
    const auto& [participant, renderer, shape] = key;
    cell.participant = participant;
    cell.fixed.assign(names.size(), 0);
    cell.fixed[0] = 1;
    if (renderer > 0) cell.fixed[renderer] = 1;
    if (shape > 0) cell.fixed[table.renderers.size() - 1 + shape] = 1;
    cell.random = {1};
    list.push_back(cell);
  }
  return mixed_logistic(list, names);
}

}  // namespace palpate::analysis
