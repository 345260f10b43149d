#pragma once
// Effects of crossed factors, and contrasts of their conditions, as weights of means.

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/design_model.h"

namespace palpate::analysis {

/// A product of factors: bit i is that of factor i.
using FactorProduct = unsigned;

bool has_factor(FactorProduct product, std::size_t factor);

/// "group:renderer"
std::string product_name(FactorProduct product, const std::vector<WithinFactor>& factors);

/// An effect of type III: that all of its combinations of unweighted cell means are 0.
struct DesignEffect {
  std::string name;
  Eigen::MatrixXd
      rows;  ///< a combination each; columns: cells, the first factor's levels outermost
};

/// Each product of the factors with more than one level, those of the first factors first.
std::vector<DesignEffect> design_effects(const std::vector<WithinFactor>& factors);

/// Weights of the mean of a group under a condition, or over all. Cells: the groups outermost.
Eigen::VectorXd condition_weights(std::size_t groups, const std::vector<WithinFactor>& within,
                                  std::size_t group,
                                  const std::optional<DesignCondition>& condition);

/// A contrast without an estimate, and its weights.
struct DesignContrast {
  GroupContrast contrast;
  Eigen::VectorXd weights;  ///< as of condition_weights
};

/// As those of compare_groups with all factors: between groups, then within them.
std::vector<DesignContrast> design_contrasts(std::size_t groups,
                                             const std::vector<WithinFactor>& within,
                                             WithinContrasts contrasts);

/// Puts means and contrasts into a model. \param estimate  of a combination of the means by group
/// and condition (condition_weights)
void put_means(std::size_t groups, const std::vector<WithinFactor>& within,
               WithinContrasts contrasts,
               const std::function<ModelEstimate(const Eigen::VectorXd&)>& estimate,
               DesignModel& out);

}  // namespace palpate::analysis
