#include "analysis/report/plan_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "protocols/json_document.h"

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

using protocols::FaultList;
using protocols::ObjectReader;
using protocols::Presence;

// Limits of what is read; those of 'palpate plan' are narrower or the same.
constexpr double kMostSd = 100;  // log seconds
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

/// \throws protocols::InputError: not JSON, or not of a plan of times in this version
nlohmann::json read_document(const std::string& text, FaultList& faults) {
  nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  if (json.is_object() && !json.contains("model"))
    faults.add("/model",
               "expected a plan of times (palpate plan --effect), found another kind of plan");
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

StudyModel read_model(ObjectReader& reader) {
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
                               {-kMostSd, kMostSd}, reader.faults());
      }
    }
  }
  reader.number("gain_sd", model.gain_sd, {0, kMostSd}, Presence::required);
  reader.number("shape_gain_sd", model.shape_gain_sd, {0, kMostSd}, Presence::required);
  reader.number("intercept_sd", model.intercept_sd, {0, kMostSd}, Presence::required);
  reader.number("correlation", model.correlation, {-1, 1}, Presence::required);
  reader.number("residual_sd", model.residual_sd, {0, kMostSd}, Presence::required);
  reader.number("share_used", model.proportion_used, {0, 1}, Presence::required);
  return model;
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
  plan.model = read_model(model);
  ObjectReader settings(member_or_null(json, "settings"), "/settings", faults);
  read_settings(settings, plan);
  read_words(reader, plan);
  read_curves(reader, plan);
  faults.throw_if_any();
  order_as_written(text, plan.model);
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

namespace {

std::string percent(double proportion) { return fixed(100 * proportion, 1) + " %"; }

std::string test_name(StudyTest test) {
  return test == StudyTest::paired ? "paired t-tests" : "the mixed model's contrasts";
}

void put_line(std::string& out, const std::string& text, const std::string& indent = "") {
  const auto fits = [&](std::string_view line) { return indent.size() + width(line) <= 100; };
  for (const std::string& line : wrapped(printable(text), fits)) {
    out += indent;
    out += shortened(line, 100 - indent.size());
    out += "\n";
  }
}

constexpr std::size_t kNameColumns = 14, kNumberColumns = 12, kWidestShape = 24;

std::string column_name(const Plan& plan, std::size_t shape) {
  return "  " +
         pad_left(shortened(printable(plan.model.shapes[shape]), kWidestShape), kNumberColumns - 2);
}

/// Appends the table of a curve, restricted to the columns of these shapes.
void put_columns(std::string& out, const Plan& plan, const PlanCurve& curve,
                 std::span<const std::size_t> shapes) {
  out += "  " + pad_right("participants", kNameColumns) + pad_left("goal", kNumberColumns);
  for (const std::size_t s : shapes) out += column_name(plan, s);
  out += "\n";
  for (const PlanPoint& point : curve.points) {
    std::string line = "  " + pad_right(std::to_string(point.design.participants), kNameColumns) +
                       pad_left(percent(goal_power(plan, point.power)), kNumberColumns);
    for (const std::size_t s : shapes) {
      line += pad_left(percent(point.power.proportion(point.power.found[s])),
                       width(column_name(plan, s)));
    }
    if (curve.smallest && curve.smallest->design.participants == point.design.participants) {
      line += "  <- enough";
    }
    out += line + "\n";
  }
}

/// Appends the table of a curve: shapes with an effect first, split where it is too wide.
void put_curve(std::string& out, const Plan& plan, const PlanCurve& curve) {
  constexpr std::size_t kShapeColumns =
      87 - 2 - kNameColumns - kNumberColumns;  // columns, without those of "<- enough"
  out += "\n";
  put_line(out, "Power with " + counted(curve.trials, "trial", "trials") +
                    " of each shape with each renderer (" +
                    counted(trials_per_participant(plan, curve.trials), "trial", "trials") +
                    " for each participant)");
  std::vector<std::size_t> shapes(plan.model.shapes.size());
  std::iota(shapes.begin(), shapes.end(), std::size_t{0});
  std::stable_partition(shapes.begin(), shapes.end(),
                        [&](std::size_t s) { return plan.model.log_ratios[s] != 0; });
  for (std::size_t first = 0, last = 0; first < shapes.size(); first = last) {
    std::size_t used = 0;
    for (; last < shapes.size(); ++last) {
      used += width(column_name(plan, shapes[last]));
      if (last > first && used > kShapeColumns) break;
    }
    if (first > 0) out += "  (continued)\n";
    put_columns(out, plan, curve, std::span(shapes).subspan(first, last - first));
  }
}

}  // namespace

std::string plan_text(const Plan& plan) {
  const PlanSettings& settings = plan.settings;
  const StudyModel& model = plan.model;
  std::string out;
  put_line(out, "To " + goal_text(plan) + ", with power " + percent(settings.power) + " at alpha " +
                    fixed(settings.simulation.alpha, 3) + " (" +
                    test_name(settings.simulation.test) + ", Holm over " +
                    counted(model.shapes.size(), "shape", "shapes") + "):");
  for (const PlanCurve& curve : plan.curves) {
    const std::string trials =
        counted(curve.trials, "trial", "trials") + " of each shape with each renderer";
    if (curve.smallest) {
      put_line(out,
               std::to_string(curve.smallest->design.participants) + " participants with " +
                   trials + " (" +
                   counted(trials_per_participant(plan, curve.trials), "trial", "trials") +
                   " for each participant): power " +
                   percent(goal_power(plan, curve.smallest->power)) + ".",
               "  ");
    } else {
      put_line(out,
               "with " + trials + " " + std::to_string(settings.max_participants) +
                   " participants are not enough: power " +
                   percent(goal_power(plan, curve.points.back().power)) + ".",
               "  ");
    }
  }
  for (const PlanCurve& curve : plan.curves) put_curve(out, plan, curve);
  out += "\n";
  put_line(out, "Log times are drawn with these standard deviations: participants' gains " +
                    fixed(model.gain_sd, 3) + ", additional gains for single shapes " +
                    fixed(model.shape_gain_sd, 3) + ", single trials " +
                    fixed(model.residual_sd, 3) + "; " + percent(model.proportion_used) +
                    " of the trials have a usable time. " +
                    std::to_string(settings.simulation.studies) +
                    " studies for each power (standard error of a power at most " +
                    percent(0.5 / std::sqrt(static_cast<double>(settings.simulation.studies))) +
                    "), seed " + std::to_string(settings.simulation.seed) +
                    ". For a shape without an effect, the number is the rate of false positives.");
  for (const std::string& note : plan.notes) put_line(out, "Note: " + note);
  return out;
}

namespace {

constexpr std::array kShapes{MarkerShape::circle, MarkerShape::square, MarkerShape::right,
                             MarkerShape::cross,  MarkerShape::left,   MarkerShape::saltire};

double log_of(std::size_t participants) { return std::log10(static_cast<double>(participants)); }

std::string power_text(double power) { return fixed(100 * power, 1) + " %"; }

FigureAxis participants_axis(std::size_t least, std::size_t most) {
  constexpr double kFewDecades = 1.7;
  constexpr std::array kParts{10, 12, 15, 20, 25, 30, 40, 50, 60, 80};  // tenths of a power of ten
  FigureAxis axis = log_axis(log_of(least), log_of(most), "participants");
  if (axis.high - axis.low > kFewDecades) return axis;
  axis.ticks.clear();
  for (std::size_t power = 1; power <= most; power *= 10) {
    for (const int part : kParts) {
      const std::size_t tenfold = power * static_cast<std::size_t>(part), n = tenfold / 10;
      if (tenfold % 10 != 0 || n < least || n > most) continue;
      axis.ticks.push_back({log_of(n), std::to_string(n)});
    }
  }
  return axis;
}

void add_wanted_power(Panel& panel, double power) {
  Mark line = line_mark(Role::ink, {panel.x.low, panel.x.high}, {100 * power, 100 * power}, 1.2);
  line.dashed = true;
  line.text = "wanted power: " + power_text(power);
  panel.marks.push_back(std::move(line));
  Mark text = text_mark(Role::ink, panel.x.low, 100 * power, "wanted", 12);
  text.anchor = -1;
  text.dx = 6;
  text.dy = -6;
  panel.marks.push_back(std::move(text));
}

void add_curve(Panel& panel, const Plan& plan, const PlanCurve& curve, Role role,
               MarkerShape shape) {
  Mark line = line_mark(role, {}, {}, 2);
  for (const PlanPoint& point : curve.points) {
    const std::size_t participants = point.design.participants;
    const double power = goal_power(plan, point.power);
    line.x.push_back(log_of(participants));
    line.y.push_back(100 * power);
    panel.marks.push_back(symbol(role, shape, line.x.back(), line.y.back(), 4.5,
                                 counted(participants, "participant", "participants") + " with " +
                                     counted(curve.trials, "trial", "trials") +
                                     " of each shape with each renderer: power " +
                                     power_text(power)));
  }
  if (line.x.size() > 1) panel.marks.push_back(std::move(line));
  if (!curve.smallest) return;
  Mark label = text_mark(role, log_of(curve.smallest->design.participants),
                         100 * goal_power(plan, curve.smallest->power),
                         std::to_string(curve.smallest->design.participants), 13);
  label.kind = Mark::Kind::label;
  label.bold = true;
  panel.marks.push_back(std::move(label));
}

}  // namespace

Figure plan_figure(const Plan& plan) {
  Figure figure;
  figure.id = "plan";
  figure.title = "Power to " + goal_text(plan);
  if (!plan.label.empty()) figure.label = plan.label + " IN THE PILOT";
  Panel panel;
  panel.x = participants_axis(plan.settings.min_participants, plan.settings.max_participants);
  panel.y = linear_axis(0, 100, "power (%)");
  panel.width = 620;
  panel.height = 320;
  add_wanted_power(panel, plan.settings.power);
  for (std::size_t c = 0; c < plan.curves.size(); ++c) {
    const PlanCurve& curve = plan.curves[c];
    const std::string name = counted(curve.trials, "trial", "trials");
    const MarkerShape shape = kShapes[c % kShapes.size()];
    add_curve(panel, plan, curve, line_role(c), shape);
    figure.legend.push_back({name, line_role(c), shape});
    figure.description += name + " of each shape with each renderer: " +
                          (curve.smallest ? std::to_string(curve.smallest->design.participants) +
                                                " participants are enough. "
                                          : std::string("not enough. "));
  }
  figure.panels.push_back(std::move(panel));
  figure.notes = {
      "Each line is for one number of trials of each shape with each renderer. The number at a "
      "line is "
      "the smallest number of participants with the wanted power."};
  return figure;
}

namespace {

std::string conclusion_of(const ThresholdPlan& plan, std::size_t trials) {
  const std::string with = counted(trials, "trial", "trials") + " with each condition: ";
  for (const ThresholdPower& one : plan.powers) {
    if (one.trials == trials && one.power >= plan.settings.power)
      return with + std::to_string(one.participants) + " participants reach a power of " +
             fixed(one.power, 2) + " [" + fixed(one.ci95.low, 2) + ", " + fixed(one.ci95.high, 2) +
             "]\n";
  }
  return with + "no number of participants in the range reaches a power of " +
         fixed(plan.settings.power, 2) + "\n";
}

}  // namespace

namespace {

const char* measure_name(PlannedMeasure measure) {
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
      break;
  }
  return "rating";
}

bool is_log(PlannedMeasure measure) {
  return measure == PlannedMeasure::jnd || measure == PlannedMeasure::threshold;
}

/// "20.0 % smaller", "0.5 JNDs higher"
std::string size_of(PlannedMeasure measure, double effect) {
  if (is_log(measure))
    return fixed(100 * std::abs(std::expm1(effect)), 1) +
           (effect <= 0 ? " % smaller" : " % larger");
  const std::string way = effect <= 0 ? " lower" : " higher";
  if (measure == PlannedMeasure::accuracy)
    return fixed(100 * std::abs(effect), 1) + " percentage points" + way;
  return fixed(std::abs(effect), 2) + (measure == PlannedMeasure::pse ? " JNDs" : " steps") + way;
}

std::string subject_of(const ThresholdStudy& study) {
  switch (study.measure) {
    case PlannedMeasure::jnd:
      return "A JND";
    case PlannedMeasure::pse:
      return "A PSE";
    case PlannedMeasure::threshold:
      return "A threshold";
    case PlannedMeasure::accuracy:
      return "An accuracy";
    case PlannedMeasure::rating:
      break;
  }
  return "A mean rating";
}

std::string bound_text(const ThresholdStudy& study) {
  if (!study.bound) return "";
  const double bound = *study.bound;
  if (is_log(study.measure))
    return fixed(100 * std::expm1(-bound), 1) + " to +" + fixed(100 * std::expm1(bound), 1) + " %";
  if (study.measure == PlannedMeasure::accuracy)
    return "+-" + fixed(100 * bound, 1) + " percentage points";
  return "+-" + fixed(bound, 2) + (study.measure == PlannedMeasure::pse ? " JNDs" : " steps");
}

/// How a study is made and tested.
std::string method_of(const ThresholdStudy& study) {
  switch (study.measure) {
    case PlannedMeasure::accuracy:
      return "Four shapes; t-test of participants' shares correct, mean over shapes.";
    case PlannedMeasure::rating:
      return "Steps 1 to 7; t-test of participants' mean ratings.";
    case PlannedMeasure::threshold:
      return "Forced choice of two, constant stimuli, seven levels by equal ratios; the group's "
             "model of all answers.";
    case PlannedMeasure::jnd:
    case PlannedMeasure::pse:
      break;
  }
  return "Constant stimuli, two intervals, seven levels around the standard; the group's model of "
         "all answers.";
}

}  // namespace

std::string threshold_plan_text(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  std::string text = "SIMULATED STUDIES\n\n" + subject_of(study) + " that is " +
                     (study.effect == 0 ? "the same" : size_of(study.measure, study.effect)) +
                     " with the second condition, within participants; " +
                     (study.bound ? "equivalence within " + bound_text(study) + " at 5 %"
                                  : "alpha " + fixed(study.alpha, 3)) +
                     "\n\n";
  for (const std::size_t trials : plan.settings.trials) text += conclusion_of(plan, trials);
  text +=
      "\n  trials  participants  power  standard error  95 % of the simulation      bias  not "
      "determined\n";
  for (const ThresholdPower& one : plan.powers) {
    const double bias = is_log(study.measure)                       ? 100 * std::expm1(one.bias)
                        : study.measure == PlannedMeasure::accuracy ? 100 * one.bias
                                                                    : one.bias;
    text += "  " + pad_left(std::to_string(one.trials), 6) + "  " +
            pad_left(std::to_string(one.participants), 12) + "  " +
            pad_left(fixed(one.power, 2), 5) + "  " + pad_left(fixed(one.se, 3), 14) + "  " +
            pad_left(fixed(one.ci95.low, 2) + " to " + fixed(one.ci95.high, 2), 22) + "  " +
            pad_left(fixed(bias, 2) + (is_log(study.measure) ? " %" : ""), 8) + "  " +
            pad_left(fixed(100 * static_cast<double>(one.undetermined) /
                               static_cast<double>(one.studies),
                           1) +
                         " %",
                     14) +
            "\n";
  }
  text += "\n" + method_of(study) +
          "\nNot determined: studies whose interval is open at both ends, or without a test.\n";
  const bool few = std::ranges::any_of(plan.settings.participants,
                                       [](std::size_t n) { return n < kLeastForBayes; });
  if (few)
    text +=
        "With fewer than nine participants a Bayes factor can never support \"no difference\" "
        "(below "
        "1/3).\n";
  return text;
}

std::string threshold_plan_json(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  nlohmann::ordered_json out{{"version", 1},
                             {"simulated", true},
                             {"measure", measure_name(study.measure)},
                             {"effect", study.effect},
                             {"effect_sd", study.effect_sd},
                             {"participant_sd", study.participant_sd},
                             {"weber_fraction", study.weber_fraction},
                             {"pse_sd_jnd", study.pse_sd},
                             {"accuracy", study.accuracy},
                             {"lapse", study.lapse},
                             {"reach_jnd", study.reach},
                             {"alpha", study.alpha},
                             {"equivalence_bound", nullptr},
                             {"wanted_power", plan.settings.power},
                             {"seed", plan.settings.seed},
                             {"powers", nlohmann::ordered_json::array()}};
  if (study.bound) out["equivalence_bound"] = *study.bound;
  for (const ThresholdPower& one : plan.powers)
    out["powers"].push_back({{"trials", one.trials},
                             {"participants", one.participants},
                             {"found", one.found},
                             {"studies", one.studies},
                             {"power", one.power},
                             {"power_se", one.se},
                             {"power_ci95", {one.ci95.low, one.ci95.high}},
                             {"bias", one.bias},
                             {"n_not_determined", one.undetermined}});
  return out.dump(1) + "\n";
}

}  // namespace palpate::analysis
