#include "analysis/statistics/weighted_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "analysis/statistics/anova.h"
#include "analysis/statistics/design_effects.h"
#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Figures by participant, with the mean of group and condition that each is of.
struct WeightedData {
  std::vector<std::vector<WeightedFigure>> people;
  Index conditions = 1, means = 1;

  Index mean_of(const WeightedFigure& one) const {
    return static_cast<Index>(one.group) * conditions + static_cast<Index>(one.condition);
  }
};

/// Estimates at given variances.
struct WeightedFit {
  double deviance = 0;  ///< -2 log restricted likelihood, without constants
  VectorXd means;
  MatrixXd covariance;
};

WeightedFit fit_at(const WeightedData& data, double between, double common) {
  MatrixXd information = MatrixXd::Zero(data.means, data.means);
  VectorXd moments = VectorXd::Zero(data.means);
  double square = 0, log_determinant = 0;
  for (const std::vector<WeightedFigure>& own : data.people) {
    // V = D + between 1 1': its inverse subtracts a share of the participant's weighted sum.
    VectorXd loads = VectorXd::Zero(data.means);
    double sum = 0, weighted = 0;
    for (const WeightedFigure& one : own) {
      const double variance = one.se * one.se + common, weight = 1 / variance;
      log_determinant += std::log(variance);
      information(data.mean_of(one), data.mean_of(one)) += weight;
      moments[data.mean_of(one)] += weight * one.value;
      square += weight * one.value * one.value;
      loads[data.mean_of(one)] += weight;
      sum += weight;
      weighted += weight * one.value;
    }
    const double share = between / (1 + between * sum);
    log_determinant += std::log1p(between * sum);
    information -= share * loads * loads.transpose();
    moments -= share * weighted * loads;
    square -= share * weighted * weighted;
  }
  const Eigen::LDLT<MatrixXd> solver(information);
  WeightedFit out;
  out.means = solver.solve(moments);
  out.covariance = solver.solve(MatrixXd::Identity(data.means, data.means));
  out.deviance =
      log_determinant + solver.vectorD().array().log().sum() + square - moments.dot(out.means);
  return out;
}

std::string why_no_weighted_model(const WeightedData& data,
                                  const std::vector<WeightedFigure>& figures, std::size_t groups) {
  std::set<Index> means;
  for (const WeightedFigure& one : figures) means.insert(data.mean_of(one));
  if (static_cast<Index>(means.size()) != data.means)
    return "a cell of the design has no figure with a standard error";
  if (data.people.size() <= groups)
    return groups == 1 ? "one participant, so no variance between participants"
                       : "one participant in each group, so no variance within groups";
  return "";
}

WeightedFit best_fit(const WeightedData& data, double scale, DesignModel& out) {
  const bool pairs =
      std::ranges::any_of(data.people, [](const auto& own) { return own.size() > 1; });
  // Standard deviations in units of the figures' spread; the deviance is even in both.
  const auto deviance = [&](const std::vector<double>& x) {
    const double common = pairs ? x[1] * scale : 0;
    return fit_at(data, x[0] * x[0] * scale * scale, common * common).deviance;
  };
  SimplexMinimum best{{}, HUGE_VAL};
  for (const auto& start : {std::vector{0.7, 0.3}, {0.2, 0.6}, {0.05, 0.05}}) {
    const std::vector<double> from = pairs ? start : std::vector{start.front()};
    SimplexMinimum found = minimize(deviance, from, std::vector(from.size(), 0.2), 1e-12);
    if (found.value < best.value) best = std::move(found);
  }
  out.participant_sd = std::abs(best.place[0]) * scale;
  out.common_sd = pairs ? std::abs(best.place[1]) * scale : 0;
  return fit_at(data, *out.participant_sd * *out.participant_sd, *out.common_sd * *out.common_sd);
}

/// Estimates and tests of combinations of the means.
class WeightedTester {
 public:
  WeightedTester(const WeightedFit& fit, double df) : fit_(fit), df_(df) {}

  ModelEstimate operator()(const VectorXd& weights) const {
    const boost::math::students_t distribution(df_);
    ModelEstimate out;
    out.estimate = weights.dot(fit_.means);
    out.se = std::sqrt(weights.dot(fit_.covariance * weights));
    out.df_satterthwaite = df_;
    out.t = *out.estimate / *out.se;
    out.p = 2 * cdf(complement(distribution, std::abs(*out.t)));
    const double half = *out.se * quantile(distribution, 0.975);
    out.ci95 = Interval{*out.estimate - half, *out.estimate + half};
    return out;
  }

  GroupEffect joint(const DesignEffect& effect) const {
    GroupEffect out;
    out.name = effect.name;
    const VectorXd found = effect.rows * fit_.means;
    const MatrixXd spread = effect.rows * fit_.covariance * effect.rows.transpose();
    out.num_df = static_cast<double>(effect.rows.rows());
    out.den_df = df_;
    out.f = found.dot(spread.ldlt().solve(found)) / *out.num_df;
    out.p = f_upper_tail(*out.f, *out.num_df, df_);
    return out;
  }

 private:
  const WeightedFit& fit_;
  double df_;
};

}  // namespace

DesignModel weighted_model(const std::vector<WeightedFigure>& figures, std::size_t groups,
                           const std::vector<WithinFactor>& conditions, WithinContrasts contrasts) {
  DesignModel out;
  out.weighted = true;
  WeightedData data;
  for (const WithinFactor& factor : conditions)
    data.conditions *= static_cast<Index>(factor.levels);
  data.means = static_cast<Index>(groups) * data.conditions;
  std::map<std::size_t, std::vector<WeightedFigure>> people;
  for (const WeightedFigure& one : figures) people[one.participant].push_back(one);
  for (auto& [participant, own] : people) data.people.push_back(std::move(own));
  out.n_observations = figures.size();
  out.n_participants = data.people.size();
  out.undefined = why_no_weighted_model(data, figures, groups);
  if (!out.undefined.empty()) return out;
  double centre = 0, square = 0;
  for (const WeightedFigure& one : figures)
    centre += one.value / static_cast<double>(figures.size());
  for (const WeightedFigure& one : figures)
    square += (one.value - centre) * (one.value - centre) / static_cast<double>(figures.size());
  if (!(square > kNoVariance * kNoVariance * std::max(1.0, centre * centre))) {
    out.undefined = "all figures are equal (no variance)";
    return out;
  }
  const WeightedFit fit = best_fit(data, std::sqrt(square), out);
  const WeightedTester tested(fit, static_cast<double>(data.people.size() - groups));
  std::vector<WithinFactor> factors{{"group", groups}};
  factors.insert(factors.end(), conditions.begin(), conditions.end());
  for (const DesignEffect& effect : design_effects(factors))
    out.effects.push_back(tested.joint(effect));
  put_means(
      groups, conditions, contrasts, [&](const VectorXd& weights) { return tested(weights); }, out);
  return out;
}

}  // namespace palpate::analysis
