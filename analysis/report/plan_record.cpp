#include "analysis/report/plan_record.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/paired.h"
#include "data/base/json_text.h"
#include "protocols/json_document.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNotReached = "the power is not reached within the range of participants";

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
    out["reason"] = kNotReached;
  }
  return out;
}

Json curve_json(const Plan& plan, const PlanCurve& curve) {
  Json out{{"trials_per_cell", curve.trials}, {"points", Json::array()}};
  for (const PlanPoint& point : curve.points) out["points"].push_back(point_json(plan, point));
  return out;
}

// A plan of another measure than times: the same keys, where a point has the counts of its studies.

bool has_model_test(PlannedMeasure measure) {
  return measure != PlannedMeasure::accuracy && measure != PlannedMeasure::rating &&
         measure != PlannedMeasure::exponent && !is_of_reaching(measure);
}

constexpr std::array kContrasts = {std::pair{"conditions", PlannedContrast::conditions},
                                   std::pair{"groups", PlannedContrast::groups},
                                   std::pair{"zero", PlannedContrast::zero}};

Json settings_json(const ThresholdPlan& plan) {
  return {
      {"power", plan.settings.power},
      {"alpha", plan.study.alpha},
      {"goal", "all"},
      {"test", has_model_test(plan.study.measure) ? "model" : "paired"},
      {"studies", plan.settings.studies},
      {"seed", plan.settings.seed},
      {"participants", {plan.settings.participants.front(), plan.settings.participants.back()}}};
}

Json model_json(const ThresholdStudy& study) {
  Json out{{"measure", to_string(study.measure)},
           {"effect", study.effect},
           {"effect_sd", study.effect_sd},
           {"participant_sd", study.participant_sd}};
  if (is_of_reaching(study.measure)) {
    out.update({{"contrast", to_string(study.contrast)},
                {"movement_sd", study.movement_sd},
                {"equivalence_bound", study.bound ? Json(*study.bound) : Json(nullptr)}});
    return out;
  }
  out.update({{"weber_fraction", study.weber_fraction},
              {"pse_sd_jnd", study.pse_sd},
              {"accuracy", study.accuracy},
              {"rating_sd", study.rating_sd},
              {"number_sd", study.number_sd},
              {"lapse", study.lapse},
              {"reach_jnd", study.reach},
              {"equivalence_bound", study.bound ? Json(*study.bound) : Json(nullptr)}});
  return out;
}

Json point_json(const ThresholdPower& one) {
  return {{"participants", one.participants},
          {"trials_per_cell", one.trials},
          {"power", one.power},
          {"simulation_se", one.se},
          {"power_ci95", {one.ci95.low, one.ci95.high}},
          {"found", one.found},
          {"studies", one.studies},
          {"bias", one.bias},
          {"n_not_determined", one.undetermined}};
}

/// The participants needed with so many trials, and the curve.
std::pair<Json, Json> curve_json(const ThresholdPlan& plan, std::size_t trials) {
  Json needed{{"trials_per_cell", trials}, {"participants", nullptr}};
  Json curve{{"trials_per_cell", trials}, {"points", Json::array()}};
  for (const ThresholdPower& one : plan.powers) {
    if (one.trials != trials) continue;
    curve["points"].push_back(point_json(one));
    if (needed["participants"].is_null() && one.power >= plan.settings.power)
      needed["participants"] = one.participants;
  }
  if (needed["participants"].is_null()) {
    needed["status"] = "undefined";
    needed["reason"] = kNotReached;
  }
  return {needed, curve};
}

using protocols::FaultList;
using protocols::ObjectReader;
using protocols::Presence;

// Limits of what is read; those of 'palpate plan' are narrower or the same.
constexpr double kMostPlannedSd = 100;  // log seconds
constexpr double kMostParticipants = 10'000, kMostTrials = 10'000, kMostStudies = 10'000'000;
constexpr std::size_t kMostShapes = 1'000, kMostCurves = 10'000, kMostLabel = 10'000;

/// A point of a plan as its file has it.
struct StatedPoint {
  StudyDesign design;
  double power = 0, power_all = 0, power_any = 0;
  std::map<std::string, double> by_shape;
};

StatedPoint read_point(ObjectReader& reader, bool in_full) {
  StatedPoint out;
  const Presence others = in_full ? Presence::required : Presence::optional;
  reader.count("participants", out.design.participants, {2, kMostParticipants});
  reader.count("trials_per_cell", out.design.trials, {1, kMostTrials});
  reader.number("power", out.power, {0, 1}, Presence::required);
  reader.number("power_all", out.power_all, {0, 1}, others);
  reader.number("power_any", out.power_any, {0, 1}, others);
  if (const auto* shapes = reader.member("power_by_shape", others)) {
    ObjectReader inner(*shapes, reader.pointer("power_by_shape"), reader.faults());
    for (const auto& [shape, value] : shapes->items())
      inner.number(shape.c_str(), out.by_shape[shape], {0, 1}, Presence::required);
  }
  return out;
}

std::vector<StatedPoint> read_points(ObjectReader& reader, bool in_full) {
  std::vector<StatedPoint> out;
  const auto* curves = reader.array("curves", 0, kMostCurves, Presence::required);
  for (std::size_t c = 0; curves != nullptr && c < curves->size(); ++c) {
    ObjectReader curve((*curves)[c], protocols::child_pointer(reader.pointer("curves"), c),
                       reader.faults());
    const auto* points = curve.array("points", 0, kMostCurves, Presence::required);
    for (std::size_t i = 0; points != nullptr && i < points->size(); ++i) {
      ObjectReader point((*points)[i], protocols::child_pointer(curve.pointer("points"), i),
                         reader.faults());
      out.push_back(read_point(point, in_full));
    }
  }
  return out;
}

/// \throws protocols::InputError: not JSON, or not a plan in this version
nlohmann::json read_document(const std::string& text, FaultList& faults) {
  nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  if (json.is_object() && !json.contains("model"))
    faults.add("/model", "expected what 'palpate plan --json' of this version wrote");
  int version = 1;
  reader.integer("version", version, {1, 1}, Presence::required);
  faults.throw_if_any();
  return json;
}

/// Adds a fault for each key that has another value than expected.
void require_same(const nlohmann::json& found, const std::string& place, const Json& expected,
                  const char* what, FaultList& faults) {
  for (const auto& [key, value] : expected.items()) {
    const nlohmann::json wanted = value;
    const auto at = found.is_object() ? found.find(key) : found.end();
    if (found.is_object() && at != found.end() && *at == wanted) continue;
    faults.add(protocols::child_pointer(place, key),
               std::string("has another ") + what + ": expected " + json_excerpt(wanted) +
                   (found.is_object() && at != found.end() ? protocols::found_text(*at)
                                                           : ", found nothing"));
  }
}

const nlohmann::json& member_or_null(const nlohmann::json& json, const char* key) {
  static const nlohmann::json null;
  const auto found = json.find(key);
  return found == json.end() ? null : *found;
}

std::size_t count_of(double proportion, std::size_t studies) {
  return static_cast<std::size_t>(std::llround(proportion * static_cast<double>(studies)));
}

StudyModel read_times(ObjectReader& reader) {
  StudyModel model;
  if (const auto* ratios = reader.member("log_ratio", Presence::required)) {
    ObjectReader inner(*ratios, reader.pointer("log_ratio"), reader.faults());
    if (ratios->is_object() && (ratios->empty() || ratios->size() > kMostShapes))
      reader.faults().add(inner.pointer(), "expected 1 to " + std::to_string(kMostShapes) +
                                               " shapes, found " + std::to_string(ratios->size()));
    if (ratios->is_object()) {
      for (const auto& [shape, value] : ratios->items()) {
        model.shapes.push_back(shape);
        protocols::read_number(value, inner.pointer(shape), model.log_ratios.emplace_back(),
                               {-kMostPlannedSd, kMostPlannedSd}, reader.faults());
      }
    }
  }
  reader.number("gain_sd", model.gain_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("shape_gain_sd", model.shape_gain_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("intercept_sd", model.intercept_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("correlation", model.correlation, {-1, 1}, Presence::required);
  reader.number("residual_sd", model.residual_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("share_used", model.proportion_used, {0, 1}, Presence::required);
  return model;
}

constexpr std::array kPlannedMeasures = {
    PlannedMeasure::jnd,       PlannedMeasure::pse,         PlannedMeasure::threshold,
    PlannedMeasure::accuracy,  PlannedMeasure::rating,      PlannedMeasure::exponent,
    PlannedMeasure::deviation, PlannedMeasure::aftereffect, PlannedMeasure::adaptation};

ThresholdStudy read_measure(ObjectReader& reader) {
  ThresholdStudy study;
  std::vector<std::pair<const char*, PlannedMeasure>> names;
  names.reserve(kPlannedMeasures.size());
  for (const PlannedMeasure one : kPlannedMeasures) names.emplace_back(to_string(one), one);
  reader.choice("measure", study.measure, names, Presence::required);
  reader.number("effect", study.effect, {-kMostPlannedSd, kMostPlannedSd}, Presence::required);
  reader.number("effect_sd", study.effect_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("participant_sd", study.participant_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("equivalence_bound", study.bound, {0, kMostPlannedSd});
  if (is_of_reaching(study.measure)) {
    reader.choice("contrast", study.contrast, kContrasts, Presence::required);
    reader.number("movement_sd", study.movement_sd, {0, kMostPlannedSd}, Presence::required);
    return study;
  }
  reader.number("weber_fraction", study.weber_fraction, {0, 10, "", true}, Presence::required);
  reader.number("pse_sd_jnd", study.pse_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("accuracy", study.accuracy, {0.01, 0.99}, Presence::required);
  reader.number("rating_sd", study.rating_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("number_sd", study.number_sd, {0, kMostPlannedSd}, Presence::required);
  reader.number("lapse", study.lapse, {0, 0.5}, Presence::required);
  reader.number("reach_jnd", study.reach, {0, kMostPlannedSd}, Presence::required);
  return study;
}

/// Puts the shapes into the order of the file, which nlohmann::json does not keep.
void order_as_written(const std::string& text, StudyModel& model) {
  const StudyModel sorted = model;
  std::size_t at = 0;
  const Json json = read_ordered_json(text);
  for (const auto& [shape, value] : json.at("model").at("log_ratio").items()) {
    const auto from = std::ranges::find(sorted.shapes, shape) - sorted.shapes.begin();
    model.shapes[at] = shape;
    model.log_ratios[at++] = sorted.log_ratios[static_cast<std::size_t>(from)];
  }
}

void read_settings(ObjectReader& settings, PlanRecord& plan) {
  settings.number("power", plan.power, {0, 1}, Presence::required);
  settings.number("alpha", plan.alpha, {0, 1, "", true}, Presence::required);
  settings.choice("goal", plan.goal, {std::pair{"all", Goal::all}, {"any", Goal::any}},
                  Presence::required);
  settings.choice("test", plan.test,
                  {std::pair{"paired", StudyTest::paired}, {"model", StudyTest::model}},
                  Presence::required);
  settings.count("studies", plan.studies, {1, kMostStudies});
}

void read_words(ObjectReader& reader, PlanRecord& plan) {
  if (const auto* label = reader.member("pilot_label", Presence::required);
      label != nullptr && !label->is_null())
    protocols::read_text(*label, reader.pointer("pilot_label"), plan.pilot_label, kMostLabel,
                         reader.faults());
  const auto* notes = reader.array("notes", 0, kMostCurves, Presence::required);
  for (std::size_t i = 0; notes != nullptr && i < notes->size(); ++i)
    protocols::read_text((*notes)[i], protocols::child_pointer("/notes", i),
                         plan.notes.emplace_back(), kMostLabel, reader.faults());
}

void read_curves(ObjectReader& reader, PlanRecord& plan) {
  const auto* needed = reader.array("needed", 1, kMostCurves, Presence::required);
  for (std::size_t i = 0; needed != nullptr && i < needed->size(); ++i) {
    ObjectReader one((*needed)[i], protocols::child_pointer("/needed", i), reader.faults());
    PlanRecord::Curve& curve = plan.curves.emplace_back();
    one.count("trials_per_cell", curve.trials, {1, kMostTrials});
    one.count("participants", curve.participants, {2, kMostParticipants});
  }
  for (const StatedPoint& point : read_points(reader, false)) {
    for (PlanRecord::Curve& curve : plan.curves) {
      if (curve.trials == point.design.trials) curve.power[point.design.participants] = point.power;
    }
  }
}

}  // namespace

std::vector<PlanPoint> read_plan_points(const std::string& text, const std::string& file,
                                        const StudyModel& model, const PlanSettings& settings) {
  FaultList faults(file);
  const nlohmann::json json = read_document(text, faults);
  Json simulation = settings_json(settings);
  for (const char* other : {"power", "goal", "participants"}) simulation.erase(other);
  require_same(member_or_null(json, "settings"), "/settings", simulation, "simulation", faults);
  require_same(member_or_null(json, "model"), "/model", model_json(model), "model", faults);
  faults.throw_if_any();
  ObjectReader reader(json, "", faults);
  std::vector<PlanPoint> points;
  for (const StatedPoint& one : read_points(reader, true)) {
    PlanPoint point;
    point.design = one.design;
    Power& power = point.power;
    power.studies = settings.simulation.studies;
    power.all = count_of(one.power_all, power.studies);
    power.any = count_of(one.power_any, power.studies);
    for (const std::string& shape : model.shapes) {
      const auto found = one.by_shape.find(shape);
      if (found == one.by_shape.end()) {
        faults.add("/curves", "expected a power_by_shape for '" + shape + "' in every point");
        break;
      }
      power.found.push_back(count_of(found->second, power.studies));
    }
    points.push_back(std::move(point));
  }
  faults.throw_if_any();
  return points;
}

PlanRecord read_plan(const std::string& text, const std::string& file) {
  FaultList faults(file);
  const nlohmann::json json = read_document(text, faults);
  ObjectReader reader(json, "", faults);
  PlanRecord plan;
  ObjectReader model(member_or_null(json, "model"), "/model", faults);
  if (model.has("measure")) {
    plan.model = read_measure(model);
  } else {
    plan.model = read_times(model);
  }
  ObjectReader settings(member_or_null(json, "settings"), "/settings", faults);
  read_settings(settings, plan);
  read_words(reader, plan);
  read_curves(reader, plan);
  faults.throw_if_any();
  if (auto* times = std::get_if<StudyModel>(&plan.model)) order_as_written(text, *times);
  if (auto* study = std::get_if<ThresholdStudy>(&plan.model)) study->alpha = plan.alpha;
  return plan;
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

std::string threshold_plan_json(const ThresholdPlan& plan) {
  Json out;
  out["version"] = 1;
  out["pilot_label"] = nullptr;
  out["settings"] = settings_json(plan);
  out["model"] = model_json(plan.study);
  out["needed"] = Json::array();
  out["curves"] = Json::array();
  for (const std::size_t trials : plan.settings.trials) {
    auto [needed, curve] = curve_json(plan, trials);
    out["needed"].push_back(std::move(needed));
    out["curves"].push_back(std::move(curve));
  }
  out["notes"] = {"Powers are of simulated studies: no person took part."};
  return out.dump(2) + "\n";
}

const PlanRecord::Curve* PlanRecord::curve_for(std::size_t trials) const {
  const auto found = std::ranges::find(curves, trials, &Curve::trials);
  return found == curves.end() ? nullptr : &*found;
}

const char* to_string(PlannedContrast contrast) {
  for (const auto& [name, one] : kContrasts) {
    if (one == contrast) return name;
  }
  return "";
}

const char* to_string(PlannedMeasure measure) {
  switch (measure) {
    case PlannedMeasure::jnd:
      return "jnd";
    case PlannedMeasure::pse:
      return "pse";
    case PlannedMeasure::threshold:
      return "threshold";
    case PlannedMeasure::accuracy:
      return "accuracy";
    case PlannedMeasure::rating:
      return "rating";
    case PlannedMeasure::exponent:
      return "exponent";
    case PlannedMeasure::deviation:
      return "deviation";
    case PlannedMeasure::aftereffect:
      return "aftereffect";
    case PlannedMeasure::adaptation:
      break;
  }
  return "adaptation";
}

}  // namespace palpate::analysis
