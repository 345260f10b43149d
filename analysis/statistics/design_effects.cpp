#include "analysis/statistics/design_effects.h"

#include <utility>

#include "analysis/statistics/anova.h"

namespace palpate::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void put_estimate(const ModelEstimate& found, GroupContrast& out) {
  out.undefined = found.undefined;
  out.estimate = found.estimate;
  out.se = found.se;
  out.df = found.df_satterthwaite;
  out.t = found.t;
  out.p = found.p;
  out.ci95 = found.ci95;
}

}  // namespace

bool has_factor(FactorProduct product, std::size_t factor) { return (product >> factor & 1) != 0; }

std::string product_name(FactorProduct product, const std::vector<WithinFactor>& factors) {
  std::string out;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (has_factor(product, i)) out += (out.empty() ? "" : ":") + factors[i].name;
  }
  return out;
}

std::vector<DesignEffect> design_effects(const std::vector<WithinFactor>& factors) {
  std::vector<DesignEffect> out;
  for (FactorProduct effect = 1; effect < 1U << factors.size(); ++effect) {
    MatrixXd rows = MatrixXd::Ones(1, 1);
    for (std::size_t i = 0; i < factors.size(); ++i) {
      const auto levels = static_cast<Index>(factors[i].levels);
      rows = kronecker(rows, has_factor(effect, i)
                                 ? helmert_contrasts(levels)
                                 : MatrixXd::Constant(1, levels, 1 / static_cast<double>(levels)));
    }
    if (rows.rows() > 0) out.push_back({product_name(effect, factors), std::move(rows)});
  }
  return out;
}

VectorXd condition_weights(std::size_t groups, const std::vector<WithinFactor>& within,
                           std::size_t group, const std::optional<DesignCondition>& condition) {
  VectorXd out = VectorXd::Unit(static_cast<Index>(groups), static_cast<Index>(group));
  for (std::size_t f = 0; f < within.size(); ++f) {
    const auto levels = static_cast<Index>(within[f].levels);
    const VectorXd one =
        condition && condition->factor == f
            ? VectorXd(VectorXd::Unit(levels, static_cast<Index>(condition->level)))
            : VectorXd::Constant(levels, 1 / static_cast<double>(levels));
    out = kronecker(out, one);
  }
  return out;
}

std::vector<DesignContrast> design_contrasts(std::size_t groups,
                                             const std::vector<WithinFactor>& within,
                                             WithinContrasts contrasts) {
  const ComparedConditions compared = compared_conditions(within, within.size());
  const auto mean = [&](std::size_t group, const std::optional<DesignCondition>& condition) {
    return condition_weights(groups, within, group, condition);
  };
  const auto difference = [&](std::size_t group, const DesignCondition& condition) -> VectorXd {
    return mean(group, condition) - mean(group, DesignCondition{condition.factor, 0});
  };
  std::vector<DesignContrast> out;
  const auto add = [&](std::size_t group, const std::optional<DesignCondition>& condition,
                       VectorXd weights) -> GroupContrast& {
    DesignContrast& made = out.emplace_back();
    made.contrast.group = group;
    made.contrast.condition = condition;
    made.weights = std::move(weights);
    return made.contrast;
  };
  for (std::size_t group = 1; group < groups; ++group) {
    for (const auto& condition : compared.means)
      add(group, condition, mean(group, condition) - mean(0, condition));
    for (const DesignCondition& condition : compared.differences)
      add(group, condition, difference(group, condition) - difference(0, condition)).of_difference =
          true;
  }
  for (std::size_t group = 0; contrasts == WithinContrasts::added && group < groups; ++group) {
    for (const DesignCondition& condition : compared.differences) {
      GroupContrast& made = add(group, condition, difference(group, condition));
      made.of_difference = made.within = true;
    }
  }
  return out;
}

void put_means(std::size_t groups, const std::vector<WithinFactor>& within,
               WithinContrasts contrasts,
               const std::function<ModelEstimate(const VectorXd&)>& estimate, DesignModel& out) {
  const ComparedConditions compared = compared_conditions(within, within.size());
  for (std::size_t group = 0; group < groups; ++group) {
    for (const auto& condition : compared.means)
      out.means.push_back(
          {group, condition, estimate(condition_weights(groups, within, group, condition))});
  }
  for (DesignContrast& one : design_contrasts(groups, within, contrasts)) {
    put_estimate(estimate(one.weights), one.contrast);
    out.contrasts.push_back(std::move(one.contrast));
  }
  adjust_contrasts(out.contrasts);
}

}  // namespace palpate::analysis
