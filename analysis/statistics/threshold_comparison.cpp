#include "analysis/statistics/threshold_comparison.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <utility>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ValuesByParticipant = std::map<std::size_t, std::map<std::size_t, double>>;

/// The REML fit for a ratio of the participants' variance to the residual one.
struct InterceptModel {
  double criterion = 0;  // -2 log restricted likelihood, but for a constant
  double residual_variance = 0;
  VectorXd means;
  MatrixXd covariance;
};

InterceptModel fit_at(const ValuesByParticipant& values, std::size_t conditions, double ratio) {
  const auto size = static_cast<Eigen::Index>(conditions);
  MatrixXd information = MatrixXd::Zero(size, size);
  VectorXd score = VectorXd::Zero(size);
  double squares = 0, log_determinant = 0, count = 0;
  for (const auto& [participant, own] : values) {
    // V = I + ratio 1 1': its inverse takes off a share of the participant's sum.
    const auto n = static_cast<double>(own.size());
    const double share = ratio / (1 + n * ratio);
    double sum = 0;
    for (const auto& [i, value] : own) {
      sum += value;
      squares += value * value;
      information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) += 1;
      for (const auto& [j, other] : own)
        information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) -= share;
    }
    for (const auto& [i, value] : own) score[static_cast<Eigen::Index>(i)] += value - share * sum;
    squares -= share * sum * sum;
    log_determinant += std::log1p(n * ratio);
    count += n;
  }
  InterceptModel model;
  const auto solver = information.ldlt();
  model.means = solver.solve(score);
  const double df = count - static_cast<double>(conditions);
  model.residual_variance = (squares - score.dot(model.means)) / df;
  model.criterion = df * std::log(model.residual_variance) + log_determinant +
                    std::log(information.determinant());
  model.covariance = model.residual_variance * information.inverse();
  return model;
}

/// The best ratio: by golden section on the logarithm, or 0.
std::pair<double, InterceptModel> fit_intercept_model(const ValuesByParticipant& values,
                                                      std::size_t conditions) {
  const auto criterion = [&](double log_ratio) {
    return fit_at(values, conditions, std::exp(log_ratio)).criterion;
  };
  const double golden = 0.6180339887498949;
  double low = -20, high = 20;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = criterion(a), at_b = criterion(b);
  for (int i = 0; i < 80; ++i) {
    if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = criterion(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = criterion(b);
    }
  }
  const double ratio = std::exp(0.5 * (low + high));
  InterceptModel best = fit_at(values, conditions, ratio), none = fit_at(values, conditions, 0);
  if (none.criterion <= best.criterion + 1e-9) return {0, none};
  return {ratio, best};
}

void add_mixed_model(ThresholdComparison& result, const ValuesByParticipant& values,
                     std::size_t conditions) {
  std::size_t count = 0;
  std::vector<std::size_t> by_condition(conditions, 0);
  for (const auto& [participant, own] : values) {
    for (const auto& [condition, value] : own) {
      ++count;
      ++by_condition[condition];
    }
  }
  for (const std::size_t n : by_condition) {
    if (n == 0) return;
  }
  if (count < conditions + values.size()) return;  // nothing is left for the residuals
  const auto [ratio, model] = fit_intercept_model(values, conditions);
  if (!(model.residual_variance > 0)) return;
  result.residual_sd = std::sqrt(model.residual_variance);
  result.participant_sd = std::sqrt(ratio * model.residual_variance);
  for (ConditionDifference& difference : result.differences) {
    const auto i = static_cast<Eigen::Index>(difference.condition);
    difference.mixed_estimate = model.means[i] - model.means[0];
    difference.mixed_se =
        std::sqrt(model.covariance(i, i) + model.covariance(0, 0) - 2 * model.covariance(i, 0));
  }
}

}  // namespace

ThresholdComparison compare_thresholds(const std::vector<ParticipantFigure>& figures,
                                       std::size_t conditions) {
  ThresholdComparison result;
  if (conditions < 2) {
    result.undefined = "fewer than two conditions";
    return result;
  }
  ValuesByParticipant values;
  for (const ParticipantFigure& figure : figures)
    values[figure.participant][figure.condition] = figure.value;
  std::vector<std::optional<double>> p;
  for (std::size_t condition = 1; condition < conditions; ++condition) {
    std::vector<double> differences;
    for (const auto& [participant, own] : values) {
      if (own.count(0) > 0 && own.count(condition) > 0)
        differences.push_back(own.at(condition) - own.at(0));
    }
    ConditionDifference difference;
    difference.condition = condition;
    difference.n_pairs = differences.size();
    if (!differences.empty()) difference.mean = mean(differences);
    difference.t_test = t_test(differences);
    difference.effect_size = effect_size(differences);
    p.push_back(difference.t_test.p);
    result.differences.push_back(std::move(difference));
  }
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < adjusted.size(); ++i)
    result.differences[i].t_test.p_holm = adjusted[i];
  add_mixed_model(result, values, conditions);
  return result;
}

}  // namespace palpate::analysis
