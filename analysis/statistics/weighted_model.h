#pragma once
// Mixed model of participants' figures, each with a standard error of its own: value ~ group *
// conditions + (1 | participant), weighted by 1 / (se^2 + a variance common to all). REML, as R's
// metafor::rma.mv (Viechtbauer 2010).

#include <cstddef>
#include <vector>

#include "analysis/statistics/design_model.h"

namespace palpate::analysis {

struct WeightedFigure {
  std::size_t participant = 0, group = 0, condition = 0;
  double value = 0, se = 0;
};

/// F = Wald's chi-squared / df; the degrees of freedom of all tests are participants - groups,
/// those of a test over participants. \param conditions  what they cross, the first factor's levels
/// outermost. \param contrasts  within groups as well
DesignModel weighted_model(const std::vector<WeightedFigure>& figures, std::size_t groups,
                           const std::vector<WithinFactor>& conditions, WithinContrasts contrasts);

}  // namespace palpate::analysis
