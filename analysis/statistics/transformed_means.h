#pragma once
// Means over participants of measures between two ends, on a scale where their intervals stay
// between the ends.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

struct TransformedMean {
  std::string undefined;         ///< why there is no interval; empty: there is one
  std::size_t n = 0;             ///< participants
  std::size_t left_out = 0;      ///< participants without the measure
  std::optional<double> mean;    ///< the mean on the scale, transformed back
  std::optional<Interval> ci95;  ///< t on the scale, transformed back
};

/// Information transfer on the scale arcsin(sqrt(bits / most)). \param most  bit, > 0
TransformedMean mean_information(const std::vector<double>& bits, double most);

/// Areas under type 2 ROCs on the logit scale, each (U + 1/2) / (correct wrong + 1). Curves without
/// correct or without wrong answers are left out and counted.
TransformedMean mean_type2_area(const std::vector<Type2Roc>& curves);

}  // namespace palpate::analysis
