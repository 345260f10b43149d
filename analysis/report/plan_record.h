#pragma once
// Sample size plans as JSON. Plans of times and of other measures have one format: settings, model,
// the needed participants, and the power curves; the model of another measure names it.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "analysis/statistics/plan.h"
#include "analysis/statistics/threshold_plan.h"

namespace palpate::analysis {

std::string plan_json(const Plan& plan);
std::string threshold_plan_json(const ThresholdPlan& plan);

/// The points of a plan from its JSON. \throws protocols::InputError: it is not output of
/// plan_json, or has another model or simulation; with every fault
std::vector<PlanPoint> read_plan_points(const std::string& text, const std::string& file,
                                        const StudyModel& model, const PlanSettings& settings);

/// The planned study, from a plan's JSON.
struct PlanRecord {
  std::variant<StudyModel, ThresholdStudy> model;  ///< of times, or of another measure
  double power = 0.8, alpha = 0.05;
  Goal goal = Goal::all;
  StudyTest test = StudyTest::paired;
  std::size_t studies = 0;  ///< simulated per power
  std::string pilot_label;  ///< "SIMULATED PARTICIPANTS"; empty: people, or no pilot
  std::vector<std::string> notes;
  struct Curve {
    std::size_t trials = 0;  ///< of a participant in a cell: shape and renderer, or condition
    std::optional<std::size_t>
        participants;                     ///< fewest that reach the power; none: not in the range
    std::map<std::size_t, double> power;  ///< by number of participants
  };
  std::vector<Curve> curves;

  const StudyModel* times() const { return std::get_if<StudyModel>(&model); }
  const ThresholdStudy* measure() const { return std::get_if<ThresholdStudy>(&model); }
  /// nullptr: none for so many trials.
  const Curve* curve_for(std::size_t trials) const;
};
/// \throws protocols::InputError: it is not output of plan_json or threshold_plan_json; with every
/// fault
PlanRecord read_plan(const std::string& text, const std::string& file);

/// Its name in a plan's JSON, and in named results: "jnd", "pse", ...
const char* to_string(PlannedMeasure measure);
/// "conditions", "groups", "zero"
const char* to_string(PlannedContrast contrast);

}  // namespace palpate::analysis
