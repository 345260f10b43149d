#pragma once

#include <string>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"

namespace palpate::analysis {

/// Posterior of a psychometric function on a grid. Priors: threshold uniform on the scale over the
/// levels and half their range beyond on both sides, but not below 0 where all levels are above;
/// log slope uniform over all that the levels can
/// tell apart; free rates with density 10 (1 - rate)^9 up to their largest value (Schuett et al.
/// 2016); one rate at both ends has that density once.
struct PsychometricPosterior {
  std::string undefined;
  protocols::PsychometricParameters mean;  ///< threshold and slope: means on the scale, of the log
  double threshold_scale_sd = 0;
  Interval threshold_ci95, slope_ci95;  ///< central
  Interval guess_ci95, lapse_ci95;      ///< of a constant: both ends are it
};

PsychometricPosterior psychometric_posterior(const std::vector<LevelCount>& counts,
                                             const PsychometricModel& model);

}  // namespace palpate::analysis
