#pragma once
// Numbers of participants and trials needed to detect a difference between the JNDs (or thresholds)
// of two renderers or conditions, from simulated studies analysed as in `analyze`.

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
  double lapse = 0.02;          ///< half of it at either asymptote
  double reach = 2.5;           ///< JNDs
  double alpha = 0.05;          ///< two-sided
};

struct ThresholdPower {
  std::size_t trials = 0;  ///< with each condition
  std::size_t participants = 0;
  std::size_t found = 0, studies = 0;
  double power = 0;
  Interval ci95;  ///< Wilson's, of the simulation
  /// Over studies with a result: mean of the estimated log ratios minus the true one, and coverage
  /// of its 95 % interval.
  double bias = 0, coverage = 0;
  std::size_t undetermined = 0;  ///< undetermined JNDs of all studies, left out
};

struct ThresholdPlanSettings {
  std::vector<std::size_t> trials, participants;  ///< each ascending
  std::size_t studies = 1000;
  std::uint64_t seed = 2000;
  double power = 0.8;                    ///< wanted
  std::function<void(double)> progress;  ///< called with the share done; may be empty
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
