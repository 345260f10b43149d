#pragma once
// How many participants, for so many trials each, find a wanted effect with a wanted power.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/power.h"

namespace palpate::analysis {

enum class Goal { all, any };  ///< find every shape with an effect, or at least one

struct PlanSettings {
  std::vector<std::size_t> trials;  ///< of each shape with each renderer: a curve each
  std::size_t least = 2, most = 2;  ///< participants, 2 <= least <= most
  double power = 0.8;
  Goal goal = Goal::all;
  PowerSettings simulation;
};

struct PlanPoint {
  StudyDesign design;
  Power power;
};

struct PlanCurve {
  std::size_t trials = 0;
  std::vector<PlanPoint> points;  ///< by participants
  std::optional<PlanPoint>
      smallest;  ///< fewest participants that reach the power; none: not so far
};

struct Plan {
  StudyModel model;
  PlanSettings settings;
  std::vector<std::string> notes;
  std::vector<PlanCurve> curves;
  std::string label;  ///< where the pilot's participants are simulated: said on the figure
};

/// A grid of participants, then halving between its points. Power grows with participants; near the
/// wanted one a study more or less is within the simulation's error.
/// \param progress which curve (from 1) and which point of it is being simulated
Plan make_plan(StudyModel model, PlanSettings settings, std::vector<std::string> notes,
               const std::function<void(std::size_t, std::size_t)>& progress);

/// Of the goal.
double goal_power(const Plan& plan, const Power& power);

/// "find the gain for cone (22.0 %) and cube (11.0 %), all of them"
std::string goal_text(const Plan& plan);
/// \param trials of each shape with each renderer
std::size_t trials_per_participant(const Plan& plan, std::size_t trials);

}  // namespace palpate::analysis
