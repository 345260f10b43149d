#pragma once
// Sample size plans as text, that of times also as a figure.

#include <string>

#include "analysis/figures/figures.h"
#include "analysis/statistics/plan.h"
#include "analysis/statistics/threshold_plan.h"

namespace palpate::analysis {

std::string plan_text(const Plan& plan);
/// Power (%) over the number of participants, a line for each number of trials.
Figure plan_figure(const Plan& plan);

std::string threshold_plan_text(const ThresholdPlan& plan);

/// A plan's measure: "JND", "mean rating".
std::string measure_in_words(PlannedMeasure measure);
/// The size of an effect: "20.0 % smaller", "0.50 JNDs higher", "the same".
std::string effect_in_words(const ThresholdStudy& study);
/// The bound of equivalence: "+-10.0 percentage points"; "": a difference is planned.
std::string bound_in_words(const ThresholdStudy& study);
/// How the studies of a plan are made and tested.
std::string method_in_words(const ThresholdStudy& study);

}  // namespace palpate::analysis
