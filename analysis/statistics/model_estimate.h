#pragma once

#include <optional>
#include <string>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Estimate and test of a coefficient or contrast (natural log of s) with Satterthwaite's degrees
/// of freedom.
struct ModelEstimate {
  std::string undefined;  ///< reason for missing values; empty: all are defined
  std::optional<double> estimate, se, df_satterthwaite, t, p;
  std::optional<Interval> ci95;
  std::optional<double> p_holm;  ///< contrasts only: adjusted over all contrasts
};

}  // namespace palpate::analysis
