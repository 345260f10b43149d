#pragma once
// The complete analysis of a study as values, which reports and figures present.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/censored.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/rm_anova.h"
#include "analysis/statistics/shape_slope_model.h"

namespace palpate::analysis {

/// Number of bins of equal length into which a participant's trials with a renderer are divided, in
/// order.
constexpr std::size_t kLearningBins = 8;

/// Mean over participants of log times (natural log of s) in a bin, relative to the participant's
/// mean for the shape, so that the mix of shapes in a bin does not bias it.
struct LearningBin {
  std::size_t n_participants = 0, n_trials = 0;
  std::optional<double> mean_log;     ///< with the renderer's overall mean added back
  std::optional<double> se_mean_log;  ///< over participants, of the relative part
};

/// Smallest number of usable trials with a renderer for which a participant's slope is estimated:
/// fewer extrapolate too far to 100 trials.
constexpr std::size_t kSlopeTrials = 32;

/// Learning with one renderer. A participant's slope is the least-squares slope of log time on the
/// number of the trial with this renderer, within shapes; mean and t interval are over
/// participants.
struct Learning {
  std::array<LearningBin, kLearningBins> bins;
  TTest slope;  ///< per 100 trials, in log seconds; sd, se, t, df, p, interval over participants
  std::optional<double> mean_slope;  ///< per 100 trials; negative: faster with practice
  std::size_t n_participants = 0;
};

/// Participants' gains (mean log renderer - mean log reference) by the renderer that came first.
struct OrderGroup {
  std::size_t n_participants = 0;
  std::optional<double> mean_log_ratio;
};

/// Two-period crossover (Hills & Armitage 1979). Practice speeds up the renderer that comes second,
/// which biases the gain by the same amount upwards with the reference first and downwards with the
/// renderer first.
struct OrderEffect {
  OrderGroup reference_first, renderer_first;
  std::string undefined;  ///< reason why the two orders cannot be compared; empty: they can
  /// Mean log ratio with reference first minus with renderer first; negative: practice shortens
  /// times.
  std::optional<double> difference;
  TTest test;  ///< of the difference, pooled variance
  /// Mean of the two groups' mean log ratios: the gain free of the effect of order.
  std::optional<double> balanced_log_ratio;
  std::optional<Interval> balanced_ci95;  ///< of log ratio
};

/// Effects of practice on the gain of a renderer over the reference.
struct PairPractice {
  TTest slope_difference;  ///< renderer - reference, participants with both, per 100 trials
  std::optional<double> mean_slope_difference;
  std::size_t n_interleaved = 0;    ///< participants with both interleaved: no order
  OrderEffect all_shapes;           ///< mean over shapes, participants with a pair in each
  std::vector<OrderEffect> shapes;  ///< one for each of table.shapes
};

/// All effects of practice.
struct Practice {
  std::vector<Learning> learning;   ///< one for each of table.renderers
  std::vector<PairPractice> pairs;  ///< one for each of renderer_pairs()
  std::size_t n_tests =
      0;  ///< tests (slopes and orders) with a p: one family for Holm's adjustment
};

/// Choices of the user.
struct AnalysisSettings {
  double too_fast =
      0.2;  ///< s, > 0; correct answers with a shorter time are excluded from the times
  std::uint64_t seed = 2000;  ///< of the bootstrap
};

/// Trials of a renderer excluded from the times, by reason: n_trials = n_timeouts + n_wrong +
/// n_too_fast + n_used.
struct Exclusions {
  std::size_t n_trials = 0, n_timeouts = 0, n_wrong = 0, n_too_fast = 0, n_used = 0;
  double proportion_excluded() const;  ///< of n_trials; 0 without trials
};

/// All results.
struct Analysis {
  AnalysisSettings settings;
  std::string program_version;  ///< of the analysing program
  TrialTable table;
  Description description;
  TimeOuts time_outs;
  std::vector<Comparison> comparisons;  ///< at least one
  RmAnova rm_anova;
  MixedModel mixed_model;
  ShapeSlopeModel shape_slope_model;  ///< of the first comparison
  Practice practice;
  std::vector<Exclusions> exclusions;  ///< one for each of table.renderers
  std::vector<std::string> warnings;   ///< of the table, and limits of the conclusions
};

/// Runs every analysis on the table. \param program_version is stored unchanged
Analysis analyze(TrialTable table, const AnalysisSettings& settings,
                 const std::string& program_version);

/// "SIMULATED PARTICIPANTS", "PARTLY SIMULATED PARTICIPANTS", or empty.
std::string simulated_label(Simulated simulated);

}  // namespace palpate::analysis
