#pragma once
// Sample size planning: the number of participants needed for a given power, for given numbers of
// trials.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/power.h"

namespace palpate::analysis {

enum class Goal { all, any };  ///< significant for every shape with an effect, or for at least one

/// Power of one design.
struct PlanPoint {
  StudyDesign design;
  Power power;
};

/// Range of designs and the goal.
struct PlanSettings {
  std::vector<std::size_t> trials;  ///< of each shape with each renderer: a power curve for each
  std::size_t min_participants = 2, max_participants = 2;  ///< 2 <= min <= max
  double power = 0.8;  ///< wanted probability of reaching the goal
  Goal goal = Goal::all;
  PowerSettings simulation;
  /// Results of earlier simulations with the same model and settings, which are reused.
  std::vector<PlanPoint> known = {};
};

/// Power over the number of participants.
struct PlanCurve {
  std::size_t trials = 0;
  std::vector<PlanPoint> points;  ///< ascending in participants
  /// Fewest participants that reach the power; none: not up to the maximum.
  std::optional<PlanPoint> smallest;
};

/// The plan.
struct Plan {
  StudyModel model;
  PlanSettings settings;
  std::vector<std::string> notes;
  std::vector<PlanCurve> curves;
  std::string label;  ///< that of the pilot: simulated participants
};

/// Simulates a logarithmic grid of numbers of participants, then bisects around the wanted power.
/// Power increases with participants up to the error of simulation. \param progress called with the
/// next curve and point (both from 1)
Plan make_plan(StudyModel model, PlanSettings settings, std::vector<std::string> notes,
               const std::function<void(std::size_t, std::size_t)>& progress);

/// Probability of reaching the goal.
double goal_power(const Plan& plan, const Power& power);

/// "find the gain for cone (22.0 %) and cube (11.0 %), all of them"
std::string goal_text(const Plan& plan);
/// \param trials of each shape with each renderer
std::size_t trials_per_participant(const Plan& plan, std::size_t trials);

}  // namespace palpate::analysis
