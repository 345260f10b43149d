#pragma once
// Answers of participants to the levels of a task, and what their psychometric functions have in
// common.

#include <optional>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {

/// Chance of a success at the ends of a function: lapses at both ends (levels on both sides of a
/// standard), guesses at a fixed rate (forced choice), or at a rate of the participant's own
/// (yes/no).
enum class GroupAsymptotes { both_lapse, fixed_guess, own_guess };

struct GroupPsychometricModel {
  protocols::PsychometricFunction function;
  GroupAsymptotes asymptotes = GroupAsymptotes::both_lapse;
  double guess = 0.5;  ///< of a forced choice
  /// Levels on one side of it: the location is the log of the threshold's distance from it.
  std::optional<double> standard;
};

/// Answers of a participant in a condition; catch trials have no stimulus.
struct GroupAnswers {
  std::vector<LevelCount> counts;
  int catch_trials = 0, catch_successes = 0;

  bool empty() const { return counts.empty(); }
};

}  // namespace palpate::analysis
