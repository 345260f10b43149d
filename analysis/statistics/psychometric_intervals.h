#pragma once
// Intervals of 95 % by the profile likelihood: what is held in them, twice the loss of log
// likelihood stays below the 0.95 quantile of chi squared with one degree of freedom.

#include "analysis/statistics/psychometric_objective.h"
#include "analysis/statistics/simplex.h"

namespace palpate::analysis {

/// Of the threshold, levels. \param best  the fit, as PsychometricObjective::best finds it
Interval threshold_interval(const PlacedData& data, const PsychometricModel& model,
                            const SimplexMinimum& best);
/// Of the slope. \param log_slope  of the fit
Interval slope_interval(const PlacedData& data, const PsychometricModel& model,
                        const SimplexMinimum& best, double log_slope);
/// Of the guess or lapse rate, within 0 and its most; of a constant, the constant twice. One rate
/// at both ends is the lapse rate.
Interval rate_interval(const PlacedData& data, const PsychometricModel& model,
                       const SimplexMinimum& best, PsychometricRate rate);

}  // namespace palpate::analysis
