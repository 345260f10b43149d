#pragma once
// Log-normal regression with time-outs as right-censored times (longer than the limit). Excluding
// time-outs instead biases the times of a slow renderer downwards.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/renderers.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/time_outs.h"

namespace palpate::analysis {

/// Estimate for one shape: log T = intercept of the participant + log_ratio (with the renderer) +
/// residual_sd N(0, 1), by maximum likelihood. Observed: the correct answers that the times use;
/// censored at their limit: time-outs; wrong answers are excluded. Participants have such trials
/// with both renderers and at least one observed time.
struct CensoredEstimate {
  std::string undefined;  ///< why values are missing; empty: all are defined
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
