#include "analysis/report/plan_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

std::string percent_of(double proportion) { return fixed(100 * proportion, 1) + " %"; }

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

constexpr std::size_t kPlanNameColumns = 14, kNumberColumns = 12, kWidestShape = 24;

std::string column_name(const Plan& plan, std::size_t shape) {
  return "  " +
         pad_left(shortened(printable(plan.model.shapes[shape]), kWidestShape), kNumberColumns - 2);
}

/// Appends the table of a curve, restricted to the columns of these shapes.
void put_columns(std::string& out, const Plan& plan, const PlanCurve& curve,
                 std::span<const std::size_t> shapes) {
  out += "  " + pad_right("participants", kPlanNameColumns) + pad_left("goal", kNumberColumns);
  for (const std::size_t s : shapes) out += column_name(plan, s);
  out += "\n";
  for (const PlanPoint& point : curve.points) {
    std::string line = "  " +
                       pad_right(std::to_string(point.design.participants), kPlanNameColumns) +
                       pad_left(percent_of(goal_power(plan, point.power)), kNumberColumns);
    for (const std::size_t s : shapes) {
      line += pad_left(percent_of(point.power.proportion(point.power.found[s])),
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
      87 - 2 - kPlanNameColumns - kNumberColumns;  // columns, without those of "<- enough"
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

std::string conclusion_of(const ThresholdPlan& plan, std::size_t trials) {
  const bool of_conditions = plan.study.contrast == PlannedContrast::conditions;
  const std::string with = counted(trials, "trial", "trials") +
                           (of_conditions ? " with each condition: " : " that give it: ");
  for (const ThresholdPower& one : plan.powers) {
    if (one.trials == trials && one.power >= plan.settings.power)
      return with + std::to_string(one.participants) + " participants reach a power of " +
             fixed(one.power, 2) + " [" + fixed(one.ci95.low, 2) + ", " + fixed(one.ci95.high, 2) +
             "]\n";
  }
  return with + "no number of participants in the range reaches a power of " +
         fixed(plan.settings.power, 2) + "\n";
}

std::string subject_of(const ThresholdStudy& study) {
  const bool vowel =
      study.measure == PlannedMeasure::accuracy || study.measure == PlannedMeasure::exponent ||
      study.measure == PlannedMeasure::aftereffect || study.measure == PlannedMeasure::adaptation;
  return (vowel ? "An " : "A ") + measure_in_words(study.measure);
}

bool is_log(PlannedMeasure measure) {
  return measure == PlannedMeasure::jnd || measure == PlannedMeasure::threshold ||
         measure == PlannedMeasure::exponent;
}

bool is_in_metres(PlannedMeasure measure) {
  return measure == PlannedMeasure::deviation || measure == PlannedMeasure::aftereffect;
}

/// Of an effect that is no ratio and no share.
std::string in_unit(PlannedMeasure measure, double value) {
  if (is_in_metres(measure)) return fixed(1e3 * value, 2) + " mm";
  if (measure == PlannedMeasure::adaptation) return fixed(value, 2);
  return fixed(value, 2) + (measure == PlannedMeasure::pse ? " JNDs" : " steps");
}

/// "with the second condition, within participants"
std::string contrast_in_words(const ThresholdStudy& study) {
  switch (study.contrast) {
    case PlannedContrast::conditions:
      return "with the second condition, within participants";
    case PlannedContrast::groups:
      return "in the second of two groups of participants";
    case PlannedContrast::zero:
      break;
  }
  return "than 0";
}

}  // namespace

std::string plan_text(const Plan& plan) {
  const PlanSettings& settings = plan.settings;
  const StudyModel& model = plan.model;
  std::string out;
  put_line(out, "To " + goal_text(plan) + ", with power " + percent_of(settings.power) +
                    " at alpha " + fixed(settings.simulation.alpha, 3) + " (" +
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
                   percent_of(goal_power(plan, curve.smallest->power)) + ".",
               "  ");
    } else {
      put_line(out,
               "with " + trials + " " + std::to_string(settings.max_participants) +
                   " participants are not enough: power " +
                   percent_of(goal_power(plan, curve.points.back().power)) + ".",
               "  ");
    }
  }
  for (const PlanCurve& curve : plan.curves) put_curve(out, plan, curve);
  out += "\n";
  put_line(out, "Log times are drawn with these standard deviations: participants' gains " +
                    fixed(model.gain_sd, 3) + ", additional gains for single shapes " +
                    fixed(model.shape_gain_sd, 3) + ", single trials " +
                    fixed(model.residual_sd, 3) + "; " + percent_of(model.proportion_used) +
                    " of the trials have a usable time. " +
                    std::to_string(settings.simulation.studies) +
                    " studies for each power (standard error of a power at most " +
                    percent_of(0.5 / std::sqrt(static_cast<double>(settings.simulation.studies))) +
                    "), seed " + std::to_string(settings.simulation.seed) +
                    ". For a shape without an effect, the number is the rate of false positives.");
  for (const std::string& note : plan.notes) put_line(out, "Note: " + note);
  return out;
}

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

std::string measure_in_words(PlannedMeasure measure) {
  switch (measure) {
    case PlannedMeasure::jnd:
      return "JND";
    case PlannedMeasure::pse:
      return "PSE";
    case PlannedMeasure::threshold:
      return "threshold";
    case PlannedMeasure::accuracy:
      return "accuracy";
    case PlannedMeasure::rating:
      return "mean rating";
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

std::string effect_in_words(const ThresholdStudy& study) {
  const double effect = study.effect;
  if (effect == 0) return "the same";
  if (is_log(study.measure))
    return fixed(100 * std::abs(std::expm1(effect)), 1) +
           (effect <= 0 ? " % smaller" : " % larger");
  const std::string way = effect <= 0 ? " lower" : " higher";
  if (study.measure == PlannedMeasure::accuracy)
    return fixed(100 * std::abs(effect), 1) + " percentage points" + way;
  return in_unit(study.measure, std::abs(effect)) + way;
}

std::string bound_in_words(const ThresholdStudy& study) {
  if (!study.bound) return "";
  const double bound = *study.bound;
  if (is_log(study.measure))
    return fixed(100 * std::expm1(-bound), 1) + " to +" + fixed(100 * std::expm1(bound), 1) + " %";
  if (study.measure == PlannedMeasure::accuracy)
    return "+-" + fixed(100 * bound, 1) + " percentage points";
  return "+-" + in_unit(study.measure, bound);
}

std::string method_in_words(const ThresholdStudy& study) {
  switch (study.measure) {
    case PlannedMeasure::accuracy:
      return "Four shapes; t-test of participants' shares correct, mean over shapes.";
    case PlannedMeasure::rating:
      return "Steps 1 to 7; t-test of participants' mean ratings.";
    case PlannedMeasure::exponent:
      return "Magnitude estimation of seven levels by equal ratios over a decade; t-test of "
             "participants' log exponents.";
    case PlannedMeasure::threshold:
      return "Forced choice of two, constant stimuli, seven levels by equal ratios; the group's "
             "model of all answers.";
    case PlannedMeasure::deviation:
    case PlannedMeasure::aftereffect:
    case PlannedMeasure::adaptation:
      return std::string("Movements to targets; ") +
             (study.contrast == PlannedContrast::groups ? "analysis of variance" : "t-test") +
             " of participants' mean " +
             (is_in_metres(study.measure) ? "deviations." : "adaptations.");
    case PlannedMeasure::jnd:
    case PlannedMeasure::pse:
      break;
  }
  return "Constant stimuli, two intervals, seven levels around the standard; the group's model of "
         "all answers.";
}

std::string threshold_plan_text(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  std::string text = "SIMULATED STUDIES\n\n" + subject_of(study) + " that is " +
                     effect_in_words(study) + " " + contrast_in_words(study) + "; " +
                     (study.bound ? "equivalence within " + bound_in_words(study) + " at 5 %"
                                  : "alpha " + fixed(study.alpha, 3)) +
                     "\n\n";
  for (const std::size_t trials : plan.settings.trials) text += conclusion_of(plan, trials);
  text +=
      "\n  trials  participants  power  standard error  95 % of the simulation      bias  not "
      "determined\n";
  for (const ThresholdPower& one : plan.powers) {
    const double bias = is_log(study.measure)                       ? 100 * std::expm1(one.bias)
                        : study.measure == PlannedMeasure::accuracy ? 100 * one.bias
                        : is_in_metres(study.measure)               ? 1e3 * one.bias
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
  text += "\n" + method_in_words(study) +
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

}  // namespace palpate::analysis
