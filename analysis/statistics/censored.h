#pragma once
// What a renderer gains when a time-out counts as what it is, a time longer than the limit. Leaving
// time-outs out makes a slow renderer look faster than it is.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/renderers.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/time_outs.h"

namespace palpate::analysis {

/// Of one shape: log T = participant + log_ratio [with the renderer] + residual_sd N(0, 1), by
/// maximum likelihood; correct answers as the times use them, time-outs censored at their limit,
/// wrong answers left out. Participants: those with trials of both renderers (of these two kinds)
/// and one time at least.
struct CensoredEstimate {
  std::string undefined;
  std::size_t n_participants = 0, n_observed = 0, n_censored = 0;
  std::optional<double> log_ratio, residual_sd;
  std::optional<double> log_likelihood;  ///< of the times themselves, not their logs
  /// From the curvature: what holds where all participants gain alike.
  std::optional<double> se_model;
  /// From the scores summed by participant (Liang & Zeger 1986) times sqrt(n / (n - 1)), so that it
  /// has the spread of participants' gains in it: with equally many trials in all cells and no
  /// time-out it is the paired t-test's.
  std::optional<double> se_log_ratio, df;
  std::optional<Interval> log_ratio_ci95;  ///< by t with df = n_participants - 1
};

/// One for each shape. Where nobody timed out with either renderer: none at all.
std::vector<CensoredEstimate> censored_by_shape(const Description& description,
                                                const TimeOuts& time_outs,
                                                const RendererPair& pair);

}  // namespace palpate::analysis
