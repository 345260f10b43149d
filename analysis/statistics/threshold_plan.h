#pragma once
// How many participants and trials find a difference between the JNDs (or thresholds) of two
// renderers or conditions: simulated studies, analysed as `analyze` does.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Constant stimuli, two intervals, levels on both sides of the standard: seven levels evenly over
/// `reach` JNDs on either side, logistic. The same participants under both conditions.
struct ThresholdStudy {
  double weber_fraction = 0.1;  ///< JND / standard with the first condition, median participant
  double ratio = 0.8;           ///< JND with the second / with the first, median participant
  double participant_sd = 0.3;  ///< of the participants' log JND
  double effect_sd = 0.2;       ///< of the participants' log ratio
  double pse_sd = 0.5;          ///< of their PSE, in JNDs
  double lapse = 0.02;          ///< half of it on either side
  double reach = 2.5;           ///< JNDs
  double alpha = 0.05;          ///< two-sided
};

struct ThresholdPower {
  std::size_t trials = 0;  ///< with each condition
  std::size_t participants = 0;
  std::size_t found = 0, studies = 0;
  double power = 0;
  Interval ci95;  ///< Wilson's, of the simulation
  /// Of studies with a result: mean of the estimated log ratios less the true one, and how often
  /// its 95 % interval holds the true one.
  double bias = 0, coverage = 0;
  std::size_t undetermined = 0;  ///< JNDs of all studies that the data did not tell: left out
};

struct ThresholdPlanSettings {
  std::vector<std::size_t> trials, participants;  ///< each ascending
  std::size_t studies = 1000;
  std::uint64_t seed = 2000;
  double power = 0.8;                    ///< wanted
  std::function<void(double)> progress;  ///< share done; may be empty
};

struct ThresholdPlan {
  ThresholdStudy study;
  ThresholdPlanSettings settings;
  std::vector<ThresholdPower> powers;  ///< by trials, then participants
};

ThresholdPlan plan_thresholds(const ThresholdStudy& study, ThresholdPlanSettings settings);

std::string threshold_plan_text(const ThresholdPlan& plan);
std::string threshold_plan_json(const ThresholdPlan& plan);

}  // namespace palpate::analysis
