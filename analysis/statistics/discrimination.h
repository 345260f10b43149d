#pragma once

#include <optional>

#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// What is read off a fitted function. JND: half the distance between the levels of F = 0.25 and
/// 0.75, on a linear scale in its unit. On a logarithmic scale the ratio of half of it less 1 is
/// the Weber fraction.
struct Discrimination {
  double pse = 0;  ///< level of F = 0.5
  Interval pse_ci95;
  std::optional<double> jnd;
  std::optional<Interval> jnd_ci95;
  std::optional<double> weber_fraction;  ///< linear scale: JND / standard, where that is above 0
  std::optional<Interval> weber_fraction_ci95;
};

/// \param standard  the level it was compared with; nullopt: the PSE
Discrimination discrimination(const PsychometricFit& fit,
                              const protocols::PsychometricFunction& function,
                              std::optional<double> standard);

}  // namespace palpate::analysis
