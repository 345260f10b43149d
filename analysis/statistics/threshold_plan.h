#pragma once
// Numbers of participants and trials needed to detect a difference between two renderers or
// conditions in JNDs, PSEs, thresholds, accuracy, ratings, exponents or measures of movements to
// targets, or to show equivalence, from simulated studies analysed as in `analyze`.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

enum class PlannedMeasure {
  jnd,
  pse,
  threshold,
  accuracy,
  rating,
  exponent,
  deviation,    ///< of movements with their field, m
  aftereffect,  ///< deviation in catch trials, m
  adaptation    ///< in clamp trials
};

/// The contrast of an effect. Only movements may contrast groups, or a condition and zero.
enum class PlannedContrast {
  conditions,  ///< the same participants under a second and a first condition
  groups,      ///< the second minus the first group of participants
  zero         ///< a condition and 0
};

/// The same participants under both conditions. JND, PSE: two intervals, constant stimuli, seven
/// levels evenly over `reach` JNDs on either side of the standard. Threshold: forced choice of two,
/// seven levels by equal ratios over `reach` widths (of the log threshold) on either side.
/// Accuracy: four shapes of equal difficulty. Ratings: steps 1 to 7. Exponents: magnitude
/// estimation of seven levels by equal ratios over a decade. Movements to targets: a participant's
/// mean over the trials that give the measure.
struct ThresholdStudy {
  PlannedMeasure measure = PlannedMeasure::jnd;
  /// Second minus first condition: of log JNDs, thresholds and exponents, of PSEs in JNDs, of
  /// shares correct, of ratings in steps, of deviations in m.
  double effect = -0.22314355131420976;
  double effect_sd = 0.2;  ///< of participants' differences, likewise; accuracy: of log odds
  /// Of log JND, threshold or exponent; accuracy: of log odds; ratings: steps.
  double participant_sd = 0.3;
  double weber_fraction = 0.1;  ///< JND / standard with the first condition, median participant
  double pse_sd = 0.5;          ///< of the PSE, in JNDs
  double width = 0.35;          ///< threshold: of the function, in logs of the level
  double accuracy = 0.8;        ///< share correct with the first condition, median participant
  double rating_sd = 1;         ///< of single ratings, steps
  double number_sd = 0.2;       ///< exponent: of single estimates, natural logs
  PlannedContrast contrast = PlannedContrast::conditions;
  double movement_sd = 0;  ///< of single movements: deviations m
  double lapse = 0.02;     ///< at either end
  double reach = 2.5;
  double alpha = 0.05;  ///< two-sided
  /// On the scale of `effect`: equivalence is to be shown; none: a difference.
  std::optional<double> bound;
};

/// Of magnitude estimation with the first condition, median participant.
inline constexpr double kTypicalExponent = 0.8;
/// Of the first condition or group, which a difference of adaptations does not depend on.
inline constexpr double kTypicalAdaptation = 0.5;

/// Of movements to targets.
bool is_of_reaching(PlannedMeasure measure);
/// The group of participant number 1, 2, ... in a plan: they alternate. 0 or 1.
constexpr std::size_t planned_group(std::size_t number) { return (number + 1) % 2; }

struct ThresholdPower {
  std::size_t trials = 0;  ///< with each condition
  std::size_t participants = 0;
  std::size_t found = 0, studies = 0;
  double power = 0;
  double se = 0;                 ///< of the simulation
  Interval ci95;                 ///< Wilson's, of the simulation
  double bias = 0;               ///< mean of the estimates minus the true difference
  std::size_t undetermined = 0;  ///< studies whose interval is open at both ends, or without a test
};

struct ThresholdPlanSettings {
  std::vector<std::size_t> trials, participants;  ///< each ascending
  std::size_t studies = 200;
  std::size_t jobs = 1;
  std::uint64_t seed = 2000;
  double power = 0.8;                    ///< wanted
  std::function<void(double)> progress;  ///< called with the share done; may be empty
};

struct ThresholdPlan {
  ThresholdStudy study;
  ThresholdPlanSettings settings;
  std::vector<ThresholdPower> powers;  ///< by trials, then participants
};

/// Of accuracy: log odds of the second minus the first condition with which the expected shares
/// differ by the effect.
double log_odds_effect(const ThresholdStudy& study);

/// A study of fewer participants is the first of a study of more. The result does not depend on the
/// number of jobs.
ThresholdPlan plan_thresholds(const ThresholdStudy& study, ThresholdPlanSettings settings);

}  // namespace palpate::analysis
