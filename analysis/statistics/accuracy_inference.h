#pragma once
// Accuracy with two renderers, compared within participants: shares of correct trials, and a
// logistic model in which participants differ in level and in the effect of the renderer.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// logit = intercept + log odds ratio r + shape + u + s r, with r = -1/2 (reference), +1/2; u and s
/// independent and normal over participants. Laplace's approximation; p and interval by the
/// likelihood ratio with the limit of group_limit().
struct AccuracyModel {
  std::string undefined;
  std::size_t participants = 0;          ///< with both renderers
  std::vector<std::string> left_out;     ///< shapes without errors, or without correct answers
  std::optional<double> log_odds_ratio;  ///< none: infinite
  double participant_sd = 0, slope_sd = 0;
  std::optional<double> likelihood_ratio, t, p;
  /// Of the log odds ratio; none: the end is open.
  std::optional<double> ci95_low, ci95_high;
};

/// Difference of shares of correct trials, renderer minus reference: mean over shapes with trials
/// of both, then over participants.
struct AccuracyDifference {
  std::size_t n = 0;  ///< participants
  std::optional<double> difference;
  TTest test;                   ///< its interval is that of the difference
  std::vector<TTest> by_shape;  ///< one for each of table.shapes; p_holm over the shapes
  std::vector<std::optional<double>> difference_by_shape;
  AccuracyModel model;
};

struct AccuracyComparison {
  AccuracyDifference all;       ///< a time-out is wrong
  AccuracyDifference answered;  ///< without time-outs
  /// One of the two tests of shares is below the level, the other is not.
  bool depends_on_time_outs = false;
};

AccuracyComparison compare_accuracy(const TrialTable& table, const RendererPair& pair);

}  // namespace palpate::analysis
