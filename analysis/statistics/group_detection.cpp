#include "analysis/statistics/group_detection.h"

#include <algorithm>
#include <cmath>

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kLeastRate = 1e-12;

const GroupAxis kSensitivities{-2, 8, 201, 0.1, 3}, kCriteria{-4, 4, 161, 0.1, 3};

double normal_share(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

double log_likelihood(int successes, int trials, double p) {
  const double rate = std::clamp(p, kLeastRate, 1 - kLeastRate);
  return successes * std::log(rate) + (trials - successes) * std::log1p(-rate);
}

GroupLikelihood scaled(MatrixXd values) {
  const double scale = values.maxCoeff();
  values = (values.array() - scale).exp();
  return group_likelihood(values, scale);
}

GroupLikelihood likelihood_of(const DetectionCounts& one) {
  if (one.signal_trials == 0 || one.noise_trials == 0) return {};
  MatrixXd values(static_cast<Index>(kSensitivities.points), static_cast<Index>(kCriteria.points));
  for (Index i = 0; i < values.rows(); ++i) {
    for (Index j = 0; j < values.cols(); ++j) {
      const double half = kSensitivities.at(static_cast<std::size_t>(i)) / 2;
      const double criterion = kCriteria.at(static_cast<std::size_t>(j));
      values(i, j) =
          log_likelihood(one.hits, one.signal_trials, normal_share(half - criterion)) +
          log_likelihood(one.false_alarms, one.noise_trials, normal_share(-half - criterion));
    }
  }
  return scaled(std::move(values));
}

GroupLikelihood likelihood_of(const ForcedChoiceCounts& one, const std::vector<double>& shares) {
  if (one.trials == 0) return {};
  MatrixXd values(static_cast<Index>(shares.size()), 1);
  for (std::size_t i = 0; i < shares.size(); ++i)
    values(static_cast<Index>(i), 0) = log_likelihood(one.correct, one.trials, shares[i]);
  return scaled(std::move(values));
}

template <class Counts, class LikelihoodOf>
std::vector<std::vector<GroupLikelihood>> likelihoods_of(
    const std::vector<std::vector<Counts>>& counts, const LikelihoodOf& likelihood) {
  std::vector<std::vector<GroupLikelihood>> out;
  for (const auto& condition : counts) {
    auto& row = out.emplace_back();
    for (const Counts& one : condition) row.push_back(likelihood(one));
  }
  return out;
}

}  // namespace

GroupData group_detection_data(const std::vector<std::vector<DetectionCounts>>& counts) {
  return {kSensitivities,
          kCriteria,
          {likelihoods_of(counts, [](const DetectionCounts& one) { return likelihood_of(one); })}};
}

GroupData group_forced_choice_data(const std::vector<std::vector<ForcedChoiceCounts>>& counts,
                                   int alternatives) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < kSensitivities.points; ++i)
    shares.push_back(forced_choice_share(kSensitivities.at(i), alternatives));
  return {kSensitivities, GroupAxis{}, {likelihoods_of(counts, [&](const ForcedChoiceCounts& one) {
            return likelihood_of(one, shares);
          })}};
}

}  // namespace palpate::analysis
