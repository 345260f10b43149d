#pragma once
// An analysis of tasks that is put together by hand: every number in it is another one.

#include <optional>
#include <string>
#include <utility>

#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis::testing {

/// Everything about it is defined, with an interval of its own.
inline ParticipantFunction full_function(const std::string& participant) {
  ParticipantFunction one;
  one.participant = participant;
  one.counts = {{200, 10, 1}, {400, 12, 9}};
  one.model.function = {protocols::PsychometricShape::normal, protocols::LevelScale::decibel,
                        protocols::Easier::higher};
  one.model.lapse = {0, true, 0.06};
  one.fit.parameters = {301.25, 2.5, 0.125, 0.03126};
  one.fit.log_likelihood = -7.25;
  one.fit.trials = 22;
  one.fit.threshold_ci95 = {281.5, 322.75};
  one.fit.slope_ci95 = {1.25, 4.75};
  one.fit.guess_ci95 = {0.0625, 0.25};
  one.fit.lapse_ci95 = {0.00004, 0.06};
  one.goodness = {3.5, 2, 0.0416, 199};
  one.determined = true;
  one.figures = {
      303.5, 21.75, 0.0625, Interval{2, 4}, Interval{1.5, 33.25}, Interval{0.03125, 0.09375}};
  one.posterior.mean = {305.5, 2.75, 0.1875, 0.015625};
  one.posterior.threshold_scale_sd = 9;
  one.posterior.threshold_ci95 = {285.5, 325.5};
  one.posterior.slope_ci95 = {1.75, 5.25};
  one.posterior.guess_ci95 = {0.09375, 0.28125};
  one.posterior.lapse_ci95 = {0.0078125, 0.046875};
  one.detectability.d_prime = 1.625;
  one.detectability.d_prime_ci95 = Interval{1.125, 2.125};
  one.detectability.criterion = -0.375;
  one.detectability.criterion_ci95 = Interval{-0.625, -0.25};
  return one;
}

inline TaskCell named_cell(const std::string& task, const std::string& block,
                           const std::string& shape, const std::string& renderer) {
  TaskCell cell;
  cell.task = task;
  cell.block_name = block;
  cell.shape = shape;
  cell.renderer = renderer;
  cell.confidence.undefined = "nobody was asked";
  return cell;
}

inline Track track_of(std::string name, protocols::ProcedureSpec spec,
                      protocols::Estimate estimate) {
  Track track;
  track.name = std::move(name);
  track.levels = {4, 2, 3};
  track.successes = {true, false, true};
  track.reversals = {1};
  track.procedure = TrackProcedure{std::move(spec), estimate, std::nullopt, std::nullopt};
  return track;
}

/// The difference of the second or third condition from the first.
inline ConditionDifference difference_of(std::size_t condition, std::size_t pairs, double mean) {
  ConditionDifference difference;
  difference.condition = condition;
  difference.n_pairs = pairs;
  difference.mean = mean;
  return difference;
}

}  // namespace palpate::analysis::testing
