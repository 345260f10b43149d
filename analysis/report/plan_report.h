#pragma once
// A sample size plan as text, JSON and a figure.

#include <string>

#include "analysis/figures/figures.h"
#include "analysis/statistics/plan.h"

namespace palpate::analysis {

std::string plan_text(const Plan& plan);
std::string plan_json(const Plan& plan);
/// Power (%) over the number of participants, a line for each number of trials.
Figure plan_figure(const Plan& plan);

}  // namespace palpate::analysis
