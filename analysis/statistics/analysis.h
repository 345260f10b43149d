#pragma once
// The complete analysis of a study as values, which reports and figures present.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/anova.h"
#include "analysis/statistics/censored.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/practice.h"

namespace palpate::analysis {

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
