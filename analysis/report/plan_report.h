#pragma once
// A sample size plan as text, JSON and a figure.

#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/plan.h"

namespace palpate::analysis {

std::string plan_text(const Plan& plan);
std::string plan_json(const Plan& plan);
/// The points of a plan from its JSON. \throws std::invalid_argument: it is not what plan_json
/// writes, or of another model or simulation than these, with what differs
std::vector<PlanPoint> read_plan_points(const std::string& json, const StudyModel& model,
                                        const PlanSettings& settings);
/// Power (%) over the number of participants, a line for each number of trials.
Figure plan_figure(const Plan& plan);

}  // namespace palpate::analysis
