#include "analysis/statistics/plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/statistics/paired.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kGridPoints = 12;

/// Numbers of participants, about equidistant on a log scale, both ends included.
std::vector<std::size_t> grid(std::size_t least, std::size_t most) {
  std::vector<std::size_t> out;
  const double low = std::log(static_cast<double>(least)),
               high = std::log(static_cast<double>(most));
  for (std::size_t i = 0; i < kGridPoints; ++i) {
    const double fraction = static_cast<double>(i) / static_cast<double>(kGridPoints - 1);
    out.push_back(static_cast<std::size_t>(std::lround(std::exp(low + fraction * (high - low)))));
  }
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// "cone (22.0 %) and cube (11.0 %)".
std::string effects(const StudyModel& model) {
  std::vector<std::string> parts;
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    if (model.log_ratios[s] == 0) continue;
    parts.push_back(model.shapes[s] + " (" + fixed(percent_reduction(model.log_ratios[s]), 1) +
                    " %)");
  }
  return joined(parts);
}

std::size_t n_effects(const StudyModel& model) {
  return model.shapes.size() - static_cast<std::size_t>(std::ranges::count(model.log_ratios, 0.0));
}

/// Null: not known, must be simulated.
const PlanPoint* find_known(const PlanSettings& settings, const StudyDesign& design) {
  for (const PlanPoint& point : settings.known) {
    if (point.design.participants == design.participants && point.design.trials == design.trials)
      return &point;
  }
  return nullptr;
}

}  // namespace

std::string goal_text(const Plan& plan) {
  std::string text = "find the gain for " + effects(plan.model);
  if (n_effects(plan.model) > 1)
    text += plan.settings.goal == Goal::all ? ", all of them" : ", any of them";
  return text;
}

std::size_t trials_per_participant(const Plan& plan, std::size_t trials) {
  return 2 * plan.model.shapes.size() * trials;
}

double goal_power(const Plan& plan, const Power& power) {
  return power.proportion(plan.settings.goal == Goal::all ? power.all : power.any);
}

Plan make_plan(StudyModel model, PlanSettings settings, std::vector<std::string> notes,
               const std::function<void(std::size_t, std::size_t)>& progress) {
  Plan plan{std::move(model), std::move(settings), std::move(notes), {}, {}};
  for (const std::size_t trials : plan.settings.trials) {
    PlanCurve curve;
    curve.trials = trials;
    const auto reaches = [&](std::size_t participants) {
      PlanPoint point{{participants, trials}, {}};
      if (const PlanPoint* known = find_known(plan.settings, point.design)) {
        point.power = known->power;
      } else {
        if (progress) progress(plan.curves.size() + 1, curve.points.size() + 1);
        point.power = simulate_power(plan.model, point.design, plan.settings.simulation);
      }
      const bool enough = goal_power(plan, point.power) >= plan.settings.power;
      curve.points.push_back(std::move(point));
      return enough;
    };
    std::optional<std::size_t> enough, short_of;
    for (const std::size_t participants :
         grid(plan.settings.min_participants, plan.settings.max_participants)) {
      const bool here = reaches(participants);
      if (here && !enough) enough = participants;
      if (!here && !enough) short_of = participants;
    }
    while (enough && short_of && *enough - *short_of > 1) {
      const std::size_t middle = (*enough + *short_of) / 2;
      (reaches(middle) ? enough : short_of) = middle;
    }
    std::ranges::sort(curve.points, {},
                      [](const PlanPoint& point) { return point.design.participants; });
    if (enough) {
      curve.smallest = *std::ranges::find(
          curve.points, *enough, [](const PlanPoint& point) { return point.design.participants; });
    }
    plan.curves.push_back(std::move(curve));
  }
  return plan;
}

}  // namespace palpate::analysis
