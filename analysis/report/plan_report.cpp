#include "analysis/report/plan_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/threshold_plan.h"
#include "analysis/text.h"
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
    throw std::invalid_argument("has another " + what + ": " + key + " is " +
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
          "expected a plan of times (palpate plan --effect), found another kind of plan");
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

std::string threshold_plan_text(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  std::string text = "SIMULATED STUDIES\n\nA JND that is " +
                     fixed(100 * std::abs(1 - study.ratio), 1) +
                     (study.ratio <= 1 ? " % smaller" : " % larger") +
                     " with the second condition, within participants; paired t-test of log "
                     "JNDs, alpha " +
                     fixed(study.alpha, 3) + "\n\n";
  for (const std::size_t trials : plan.settings.trials) text += conclusion_of(plan, trials);
  text +=
      "\n  trials  participants  power  95 % of the simulation  bias of the ratio  coverage  "
      "left out\n";
  for (const ThresholdPower& one : plan.powers) {
    const double pairs = static_cast<double>(one.participants * one.studies);
    text +=
        "  " + pad_left(std::to_string(one.trials), 6) + "  " +
        pad_left(std::to_string(one.participants), 12) + "  " + pad_left(fixed(one.power, 2), 5) +
        "  " + pad_left(fixed(one.ci95.low, 2) + " to " + fixed(one.ci95.high, 2), 22) + "  " +
        pad_left(fixed(100 * (std::exp(one.bias) - 1), 1) + " %", 17) + "  " +
        pad_left(fixed(one.coverage, 2), 8) + "  " +
        pad_left(fixed(100 * static_cast<double>(one.undetermined) / pairs, 1) + " %", 8) + "\n";
  }
  return text +
         "\nConstant stimuli, two intervals, seven levels around the standard; each JND is fitted "
         "as "
         "analyze does.\nLeft out: JNDs that a participant's data do not determine.\n";
}

std::string threshold_plan_json(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  nlohmann::ordered_json out{{"version", 1},
                             {"simulated", true},
                             {"weber_fraction", study.weber_fraction},
                             {"jnd_ratio", study.ratio},
                             {"participant_sd", study.participant_sd},
                             {"effect_sd", study.effect_sd},
                             {"pse_sd_jnd", study.pse_sd},
                             {"lapse", study.lapse},
                             {"reach_jnd", study.reach},
                             {"alpha", study.alpha},
                             {"wanted_power", plan.settings.power},
                             {"seed", plan.settings.seed},
                             {"powers", nlohmann::ordered_json::array()}};
  for (const ThresholdPower& one : plan.powers)
    out["powers"].push_back({{"trials", one.trials},
                             {"participants", one.participants},
                             {"found", one.found},
                             {"studies", one.studies},
                             {"power", one.power},
                             {"power_ci95", {one.ci95.low, one.ci95.high}},
                             {"log_ratio_bias", one.bias},
                             {"coverage", one.coverage},
                             {"n_undetermined", one.undetermined}});
  return out.dump(1) + "\n";
}

}  // namespace palpate::analysis
