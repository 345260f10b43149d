#include "analysis/statistics/mixed_anova.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "analysis/statistics/anova.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// A set of factors within participants, as a bit each.
using Subset = std::size_t;

std::string name_of(Subset subset, const std::vector<WithinFactor>& within) {
  std::string out;
  for (std::size_t i = 0; i < within.size(); ++i) {
    if (subset >> i & 1) out += (out.empty() ? "" : ":") + within[i].name;
  }
  return out;
}

/// Orthonormal contrasts of the cells for an effect; of no factor: their mean.
MatrixXd contrasts_of(Subset subset, const std::vector<WithinFactor>& within) {
  MatrixXd out = MatrixXd::Ones(1, 1);
  for (std::size_t i = 0; i < within.size(); ++i) {
    const auto levels = static_cast<Index>(within[i].levels);
    out = kronecker(out, subset >> i & 1 ? helmert_contrasts(levels) : unit_average(levels));
  }
  return out;
}

/// Participants' scores on the contrasts of an effect within them.
struct GroupScores {
  MatrixXd means;     ///< groups x contrasts
  MatrixXd residual;  ///< contrasts x contrasts, sums of products within groups
  double ss_error() const { return residual.trace(); }
};

GroupScores group_scores(const std::vector<GroupedRow>& rows, const VectorXd& n,
                         const MatrixXd& weights) {
  GroupScores out{MatrixXd::Zero(n.size(), weights.rows()),
                  MatrixXd::Zero(weights.rows(), weights.rows())};
  MatrixXd all(static_cast<Index>(rows.size()), weights.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Map<const VectorXd> values(rows[i].values.data(),
                                            static_cast<Index>(rows[i].values.size()));
    all.row(static_cast<Index>(i)) = (weights * values).transpose();
    out.means.row(static_cast<Index>(rows[i].group)) += all.row(static_cast<Index>(i));
  }
  out.means.array().colwise() /= n.array();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RowVectorXd rest =
        all.row(static_cast<Index>(i)) - out.means.row(static_cast<Index>(rows[i].group));
    out.residual += rest.transpose() * rest;
  }
  return out;
}

/// The hypothesis that these combinations of the group means are 0. \param between  one a row
/// \param noise  a standard deviation that is none
GroupEffect effect_of(std::string name, const GroupScores& scores, const VectorXd& n,
                      double participants, const MatrixXd& between, double all_error,
                      double noise) {
  GroupEffect out;
  out.name = std::move(name);
  const MatrixXd tested = between * scores.means;
  const MatrixXd spread = between * n.cwiseInverse().asDiagonal() * between.transpose();
  const double ss = (tested.transpose() * spread.ldlt().solve(tested)).trace();
  const auto p = static_cast<double>(scores.residual.rows());
  const double error_df = (participants - static_cast<double>(n.size())) * p;
  out.num_df = p * static_cast<double>(between.rows());
  out.den_df = error_df;
  const double error = scores.ss_error() / error_df;
  if (std::sqrt(error) <= std::max(noise, kNoVariance * std::max(1.0, scores.means.norm()))) {
    out.undefined = "the effect is equal in all participants of a group (no variance)";
    return out;
  }
  if (!std::isfinite(ss) || !std::isfinite(error) || !std::isfinite(all_error)) {
    out.undefined = "numbers too large";
    return out;
  }
  out.f = ss / *out.num_df / error;
  out.p = f_upper_tail(*out.f, *out.num_df, error_df);
  out.generalized_eta_squared = ss / (ss + all_error);
  if (p < 2) return out;
  const double e =
      std::min(1.0, std::pow(scores.ss_error(), 2) / (p * scores.residual.squaredNorm()));
  out.gg_epsilon = e;
  out.gg_p = f_upper_tail(*out.f, *out.num_df * e, error_df * e);
  return out;
}

}  // namespace

double figure_noise(const std::vector<GroupedRow>& rows) {
  double largest = 0;
  for (const GroupedRow& row : rows) {
    for (const double value : row.values) largest = std::max(largest, std::fabs(value));
  }
  return kFigureNoise * largest;
}

MixedAnova mixed_anova(const std::vector<GroupedRow>& rows, std::size_t groups,
                       const std::vector<WithinFactor>& within) {
  MixedAnova out;
  out.n.assign(groups, 0);
  for (const GroupedRow& row : rows) ++out.n[row.group];
  if (std::ranges::find(out.n, std::size_t{0}) != out.n.end())
    out.undefined = "a group has no participant with a value in every cell";
  else if (rows.size() <= groups)
    out.undefined = groups < 2 ? "one participant, so no variance"
                               : "one participant in each group, so no variance within groups";
  if (!out.undefined.empty()) return out;

  VectorXd n(static_cast<Index>(groups));
  for (std::size_t i = 0; i < groups; ++i) n(static_cast<Index>(i)) = static_cast<double>(out.n[i]);
  std::vector<GroupScores> scores;
  double all_error = 0;
  const double noise = figure_noise(rows);
  for (Subset subset = 0; subset < Subset{1} << within.size(); ++subset) {
    scores.push_back(group_scores(rows, n, contrasts_of(subset, within)));
    all_error += scores.back().ss_error();
  }
  const MatrixXd unweighted = MatrixXd::Constant(1, n.size(), 1 / static_cast<double>(groups));
  for (Subset subset = 0; subset < scores.size(); ++subset) {
    if (scores[subset].residual.rows() == 0) continue;  // a factor of one level
    const std::string name = name_of(subset, within);
    const auto add = [&](const std::string& effect, const MatrixXd& between) {
      out.effects.push_back(effect_of(effect, scores[subset], n, static_cast<double>(rows.size()),
                                      between, all_error, noise));
    };
    if (!name.empty()) add(name, unweighted);
    if (groups > 1) add(name.empty() ? "group" : "group:" + name, helmert_contrasts(n.size()));
  }
  return out;
}

}  // namespace palpate::analysis
