#pragma once
// The whole analysis of a study as values; the reports only write it down.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/anova.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/mixed_model.h"
#include "analysis/statistics/practice.h"
#include "analysis/statistics/time_outs.h"

namespace palpate::analysis {

struct AnalysisSettings {
  double too_fast = 0.2;      ///< s, > 0; correct answers before it are left out of the times
  std::uint64_t seed = 2000;  ///< of the bootstrap
};

/// What a renderer loses on the way from trials to times.
struct Exclusions {
  std::size_t n_trials = 0, n_timeouts = 0, n_wrong = 0, n_too_fast = 0, n_used = 0;
  double share_excluded() const;  ///< of n_trials; 0 without trials
};

struct Analysis {
  AnalysisSettings settings;
  std::string program_version;  ///< of the program that analyses
  TrialTable table;
  Description description;
  TimeOuts time_outs;
  std::vector<Comparison> comparisons;  ///< one at least
  RmAnova rm_anova;
  MixedModel mixed_model;
  Practice practice;
  std::vector<Exclusions> exclusions;  ///< one for each of table.renderers
  std::vector<std::string> warnings;   ///< the table's, and what limits the conclusions
};

Analysis analyze(TrialTable table, const AnalysisSettings& settings,
                 const std::string& program_version);

/// "SIMULATED PARTICIPANTS", "PARTLY SIMULATED PARTICIPANTS", or empty.
std::string simulated_label(Simulated simulated);

}  // namespace palpate::analysis
