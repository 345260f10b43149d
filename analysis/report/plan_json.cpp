#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "analysis/report/plan_report.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

namespace {

using Json = nlohmann::ordered_json;

Json point_json(const Plan& plan, const PlanPoint& point) {
  const Power& power = point.power;
  Json out{{"participants", point.design.participants},
           {"trials_per_cell", point.design.trials},
           {"power", goal_power(plan, power)}};
  const double share = goal_power(plan, power);
  out["simulation_se"] = std::sqrt(share * (1 - share) / static_cast<double>(power.studies));
  out["power_all"] = power.proportion(power.all);
  out["power_any"] = power.proportion(power.any);
  for (std::size_t s = 0; s < plan.model.shapes.size(); ++s) {
    out["power_by_shape"][plan.model.shapes[s]] = power.proportion(power.found[s]);
  }
  return out;
}

Json settings_json(const PlanSettings& settings) {
  return {{"power", settings.power},
          {"alpha", settings.simulation.alpha},
          {"goal", settings.goal == Goal::all ? "all" : "any"},
          {"test", settings.simulation.test == StudyTest::paired ? "paired" : "model"},
          {"studies", settings.simulation.studies},
          {"seed", settings.simulation.seed},
          {"participants", {settings.min_participants, settings.max_participants}}};
}

Json model_json(const StudyModel& model) {
  Json out;
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    out["percent_reduction"][model.shapes[s]] =
        model.log_ratios[s] == 0 ? 0 : percent_reduction(model.log_ratios[s]);
    out["log_ratio"][model.shapes[s]] = model.log_ratios[s];
  }
  out["gain_sd"] = model.gain_sd;
  out["shape_gain_sd"] = model.shape_gain_sd;
  out["intercept_sd"] = model.intercept_sd;
  out["correlation"] = model.correlation;
  out["residual_sd"] = model.residual_sd;
  out["share_used"] = model.proportion_used;
  return out;
}

Json needed_json(const Plan& plan, const PlanCurve& curve) {
  Json out{
      {"trials_per_cell", curve.trials},
      {"trials_per_participant", trials_per_participant(plan, curve.trials)},
      {"participants", curve.smallest ? Json(curve.smallest->design.participants) : Json(nullptr)}};
  if (!curve.smallest) {
    out["status"] = "undefined";
    out["reason"] = "the power is not reached within the range of participants";
  }
  return out;
}

Json curve_json(const Plan& plan, const PlanCurve& curve) {
  Json out{{"trials_per_cell", curve.trials}, {"points", Json::array()}};
  for (const PlanPoint& point : curve.points) out["points"].push_back(point_json(plan, point));
  return out;
}

std::size_t count_of(const Json& proportion, std::size_t studies) {
  return static_cast<std::size_t>(
      std::llround(proportion.get<double>() * static_cast<double>(studies)));
}

/// \throws std::invalid_argument
void require_same(const std::string& what, const Json& found, const Json& expected) {
  for (const auto& [key, value] : expected.items()) {
    if (found.contains(key) && found.at(key) == value) continue;
    throw std::invalid_argument("is of another " + what + ": " + key + " is " +
                                (found.contains(key) ? found.at(key).dump() : "missing") +
                                ", expected " + value.dump());
  }
}

}  // namespace

std::vector<PlanPoint> read_plan_points(const std::string& json, const StudyModel& model,
                                        const PlanSettings& settings) {
  try {
    const Json in = Json::parse(json);
    Json simulation = settings_json(settings);
    for (const char* other : {"power", "goal", "participants"}) simulation.erase(other);
    require_same("plan", in, {{"version", 1}});
    require_same("simulation", in.at("settings"), simulation);
    require_same("model", in.at("model"), model_json(model));
    std::vector<PlanPoint> points;
    for (const Json& curve : in.at("curves")) {
      for (const Json& one : curve.at("points")) {
        PlanPoint point;
        point.design = {one.at("participants"), one.at("trials_per_cell")};
        Power& power = point.power;
        power.studies = settings.simulation.studies;
        power.all = count_of(one.at("power_all"), power.studies);
        power.any = count_of(one.at("power_any"), power.studies);
        for (const std::string& shape : model.shapes)
          power.found.push_back(count_of(one.at("power_by_shape").at(shape), power.studies));
        points.push_back(std::move(point));
      }
    }
    return points;
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("is not what 'palpate plan --json' writes: ") +
                                error.what());
  }
}

std::string plan_json(const Plan& plan) {
  Json out;
  out["version"] = 1;
  out["pilot_label"] = plan.label.empty() ? Json(nullptr) : Json(plan.label);
  out["settings"] = settings_json(plan.settings);
  out["model"] = model_json(plan.model);
  out["needed"] = Json::array();
  out["curves"] = Json::array();
  for (const PlanCurve& curve : plan.curves) {
    out["needed"].push_back(needed_json(plan, curve));
    out["curves"].push_back(curve_json(plan, curve));
  }
  out["notes"] = plan.notes;
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace palpate::analysis
