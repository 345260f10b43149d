#pragma once
// Log-normal regression with time-outs as right-censored times (longer than the limit). Excluding
// time-outs instead biases the times of a slow renderer downwards.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Trials of one participant in one cell that ended at the same time limit, at which their times
/// are right-censored.
struct TimeOutGroup {
  std::uint32_t participant = 0;
  double limit = 0;  ///< s; unknown if not finite or not above 0
  std::size_t n = 0;

  bool has_limit() const;
};

/// Time-outs of a renderer and shape.
struct TimeOutCell {
  std::size_t n_trials = 0, n_timeouts = 0;
  std::vector<TimeOutGroup> groups;  ///< by participant, then limit
  std::optional<std::size_t>
      most_affected;              ///< participant with the largest proportion; none: no time-outs
  double largest_proportion = 0;  ///< time-outs of that participant's trials
  std::optional<double> lowest_limit, highest_limit;  ///< s; none: no known limit

  double proportion() const;  ///< of n_trials; 0 without trials
};

/// Time-outs of the study.
struct TimeOuts {
  bool any = false;
  std::vector<std::vector<TimeOutCell>> cells;  ///< [renderer][shape]
};

TimeOuts time_outs(const TrialTable& table, const Description& description);

/// Estimate for one shape: log T = intercept of the participant + log_ratio (with the renderer) +
/// residual_sd N(0, 1), by maximum likelihood. Observed: correct answers with a usable time;
/// censored at their limit: time-outs; wrong answers are excluded. Participants have such trials
/// with both renderers and at least one observed time.
struct CensoredEstimate {
  std::string undefined;  ///< reason for missing values; empty: all are defined
  std::size_t n_participants = 0, n_observed = 0, n_censored = 0;
  std::optional<double> log_ratio, residual_sd;
  std::optional<double> log_likelihood;  ///< of the times, not of their logs
  /// From the observed information: valid if all participants have the same gain.
  std::optional<double> se_model;
  /// Cluster-robust (sandwich) standard error with participants as clusters (Liang & Zeger 1986)
  /// times sqrt(n / (n - 1)): allows participants' gains to vary. With equal numbers of trials in
  /// all cells and no time-out it equals that of the paired t-test.
  std::optional<double> se_log_ratio, df;
  std::optional<Interval> log_ratio_ci95;  ///< by t with df = n_participants - 1
};

/// One estimate for each shape; empty without any time-out with the two renderers.
std::vector<CensoredEstimate> censored_by_shape(const Description& description,
                                                const TimeOuts& time_outs,
                                                const RendererPair& pair);

}  // namespace palpate::analysis
