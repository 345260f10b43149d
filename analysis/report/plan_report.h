#pragma once
// Sample size plans as text and JSON, that of times also as a figure.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/plan.h"
#include "analysis/statistics/threshold_plan.h"

namespace palpate::analysis {

std::string plan_text(const Plan& plan);
std::string plan_json(const Plan& plan);
/// The points of a plan from its JSON. \throws protocols::InputError: it is not output of
/// plan_json, or has another model or simulation; with every fault
std::vector<PlanPoint> read_plan_points(const std::string& text, const std::string& file,
                                        const StudyModel& model, const PlanSettings& settings);
/// The planned study, from a plan's JSON.
struct PlanRecord {
  StudyModel model;
  double power = 0.8, alpha = 0.05;
  Goal goal = Goal::all;
  StudyTest test = StudyTest::paired;
  std::size_t studies = 0;  ///< simulated per power
  std::string pilot_label;  ///< "SIMULATED PARTICIPANTS"; empty: people, or no pilot
  std::vector<std::string> notes;
  struct Curve {
    std::size_t trials = 0;  ///< of each shape with each renderer
    std::optional<std::size_t>
        participants;                     ///< fewest that reach the power; none: not in the range
    std::map<std::size_t, double> power;  ///< by number of participants
  };
  std::vector<Curve> curves;
};
/// \throws protocols::InputError: it is not output of plan_json; with every fault
PlanRecord read_plan(const std::string& text, const std::string& file);
/// Power (%) over the number of participants, a line for each number of trials.
Figure plan_figure(const Plan& plan);

std::string threshold_plan_text(const ThresholdPlan& plan);
std::string threshold_plan_json(const ThresholdPlan& plan);

}  // namespace palpate::analysis
