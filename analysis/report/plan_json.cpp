#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "analysis/report/plan_report.h"
#include "analysis/statistics/paired.h"
#include "data/base/json_text.h"

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
                                (found.contains(key) ? json_excerpt(found.at(key)) : "missing") +
                                ", expected " + json_excerpt(value));
  }
}

}  // namespace

std::vector<PlanPoint> read_plan_points(const std::string& json, const StudyModel& model,
                                        const PlanSettings& settings) {
  try {
    const Json in = read_ordered_json(json);
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
  } catch (const JsonError& error) {
    throw std::invalid_argument(std::string("is not what 'palpate plan --json' writes: ") +
                                error.what());
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("is not what 'palpate plan --json' writes: ") +
                                error.what());
  }
}

namespace {

double number_within(const Json& object, const char* key, double least, double most) {
  const auto value = object.at(key).get<double>();
  if (value >= least && value <= most) return value;
  throw std::invalid_argument(std::string("has an impossible ") + key + ": " +
                              object.at(key).dump());
}

StudyModel read_model(const Json& in) {
  constexpr double kMostSd = 100;
  StudyModel model;
  for (const auto& [shape, ratio] : in.at("log_ratio").items()) {
    model.shapes.push_back(shape);
    model.log_ratios.push_back(ratio.get<double>());
    if (!(std::fabs(model.log_ratios.back()) <= kMostSd))
      throw std::invalid_argument("has an impossible log_ratio: " + ratio.dump());
  }
  if (model.shapes.empty()) throw std::invalid_argument("has no shapes");
  model.gain_sd = number_within(in, "gain_sd", 0, kMostSd);
  model.shape_gain_sd = number_within(in, "shape_gain_sd", 0, kMostSd);
  model.intercept_sd = number_within(in, "intercept_sd", 0, kMostSd);
  model.correlation = number_within(in, "correlation", -1, 1);
  model.residual_sd = number_within(in, "residual_sd", 0, kMostSd);
  model.proportion_used = number_within(in, "share_used", 0, 1);
  return model;
}

/// One of two words.
bool is_first(const Json& value, const char* first, const char* second) {
  const auto word = value.get<std::string>();
  if (word != first && word != second)
    throw std::invalid_argument("expected " + std::string(first) + " or " + second + ", found " +
                                json_excerpt(value));
  return word == first;
}

}  // namespace

PlanRecord read_plan(const std::string& json) {
  try {
    const Json in = read_ordered_json(json);
    if (in.is_object() && !in.contains("model"))
      throw std::invalid_argument(
          "expected a plan of times (palpate plan --effect); this is another one");
    require_same("version of plans", in, {{"version", 1}});
    PlanRecord plan;
    plan.model = read_model(in.at("model"));
    const Json& settings = in.at("settings");
    plan.power = number_within(settings, "power", 0, 1);
    plan.alpha = number_within(settings, "alpha", 0, 1);
    plan.goal = is_first(settings.at("goal"), "all", "any") ? Goal::all : Goal::any;
    plan.test =
        is_first(settings.at("test"), "paired", "model") ? StudyTest::paired : StudyTest::model;
    plan.studies = settings.at("studies").get<std::size_t>();
    if (in.at("pilot_label").is_string()) plan.pilot_label = in.at("pilot_label");
    for (const Json& note : in.at("notes")) plan.notes.push_back(note.get<std::string>());
    for (const Json& needed : in.at("needed")) {
      PlanRecord::Curve& curve = plan.curves.emplace_back();
      curve.trials = needed.at("trials_per_cell").get<std::size_t>();
      const Json& participants = needed.at("participants");
      if (!participants.is_null()) curve.participants = participants.get<std::size_t>();
    }
    for (const Json& points : in.at("curves")) {
      for (const Json& point : points.at("points")) {
        for (PlanRecord::Curve& curve : plan.curves) {
          if (curve.trials == point.at("trials_per_cell").get<std::size_t>())
            curve.power[point.at("participants").get<std::size_t>()] =
                number_within(point, "power", 0, 1);
        }
      }
    }
    return plan;
  } catch (const JsonError& error) {
    throw std::invalid_argument(std::string("is not what 'palpate plan --json' writes: ") +
                                error.what());
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
