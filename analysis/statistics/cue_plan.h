#pragma once
// Power of a study of seen and felt cues, from many simulated studies of people of two rules.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "analysis/statistics/cues.h"

namespace palpate::analysis {

struct CuePlanSettings {
  double haptic = 0.1, visual = 0.1;  ///< sd of a single estimate, as a share of the standard
  double spread = 0.2;                ///< between people, sd of the log of both
  double conflict = 0;                ///< share of the standard; 0: the mean of both
  std::size_t participants = 12, levels = 7;
  std::size_t trials = 30;  ///< at a level, in each of five blocks
  std::size_t studies = 40;
  double lapse = 0.02;
  int resamples = 100;  ///< of the better cue's bias
  std::uint64_t seed = 2000;
  std::size_t jobs = 1;
  std::function<void(double)> progress;  ///< share that is done
};

/// Studies of people of one rule: shares of them, at the level of 5 %.
struct CuePlanResult {
  CueModel rule = CueModel::optimal;             ///< or best_cue
  double weight_difference = 0;                  ///< mean, observed less predicted
  double jnd_by_predicted = 0;                   ///< mean of logs
  double weight_rejected = 0, jnd_rejected = 0;  ///< differs from the prediction
  double below_better = 0;                       ///< JND with both below the better cue's
  double best_model = 0;                         ///< least summed AIC is that of the rule
};

/// The share by which the JND of both cues is below that of the better one, of an optimal
/// combination. \param ratio  of the larger by the smaller sd
double gain_over_better(double ratio);

/// Beyond this ratio the gain is too small to be promised (10.6 %).
inline constexpr double kMostCueRatio = 2;

/// Both rules; the same for any number of jobs.
std::vector<CuePlanResult> plan_cues(const CuePlanSettings& settings);

}  // namespace palpate::analysis
