#pragma once
// Does practice explain the gain? Learning over trials, and which renderer came first.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/renderers.h"
#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// A participant's trials with a renderer are cut, in order, into so many parts of equal length.
constexpr std::size_t kLearningBins = 8;

/// Mean over participants of log times (natural log of s), each taken relative to the participant's
/// own mean for the shape, so that a chance mix of shapes does not look like learning.
struct LearningBin {
  std::size_t n_participants = 0, n_trials = 0;
  std::optional<double> mean_log;     ///< with the renderer's overall mean added back
  std::optional<double> se_mean_log;  ///< over participants, of the relative part
};

/// Trials with a renderer that the times use, from which a participant has a slope: a change per
/// 100 trials from fewer is an extrapolation that says nothing.
constexpr std::size_t kSlopeTrials = 32;

/// Of one renderer. The slope is each participant's least-squares slope of log time on the number
/// of the trial with this renderer, within shapes; then a t interval over participants.
struct Learning {
  std::array<LearningBin, kLearningBins> bins;
  TTest slope;  ///< per 100 trials, in log seconds; sd, se, t, df, p, interval over participants
  std::optional<double> mean_slope;  ///< per 100 trials; negative: faster with practice
  std::size_t n_participants = 0;
};

/// Participants' gains (mean log renderer - mean log reference) by which of the two came first.
struct OrderGroup {
  std::size_t n_participants = 0;
  std::optional<double> mean_log_ratio;
};

/// Two-period crossover (Hills & Armitage 1979). Practice makes the second renderer look faster: a
/// gain is reference-first's too large and renderer-first's too small by the same amount.
struct OrderEffect {
  OrderGroup reference_first, renderer_first;
  std::string undefined;  ///< why the two orders cannot be compared
  /// Mean log ratio of reference first minus renderer first; pooled variance. Negative: practice
  /// helps.
  std::optional<double> difference;
  TTest test;  ///< of the difference
  /// Mean of the two groups' mean log ratios: the gain with practice balanced.
  std::optional<double> balanced_log_ratio;
  std::optional<Interval> balanced_ci95;  ///< of log ratio
};

/// What practice does to the gain of a renderer over the reference.
struct PairPractice {
  TTest slope_difference;  ///< renderer - reference, participants with both, per 100 trials
  std::optional<double> mean_slope_difference;
  std::size_t n_interleaved = 0;    ///< participants whose trials of both are mixed: no order
  OrderEffect all_shapes;           ///< mean over shapes, participants with a pair in each
  std::vector<OrderEffect> shapes;  ///< one for each of table.shapes
};

struct Practice {
  std::vector<Learning> learning;   ///< one for each of table.renderers
  std::vector<PairPractice> pairs;  ///< one for each of renderer_pairs()
  std::size_t n_tests = 0;          ///< slopes and orders with a p: one family for their p_holm
};

/// \param too_fast s, as in describe()
Practice practice_effects(const TrialTable& table, const Description& description, double too_fast);

}  // namespace palpate::analysis
