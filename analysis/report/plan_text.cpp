#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "analysis/report/plan_report.h"
#include "analysis/text.h"

namespace palpate::analysis {

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
  put_line(out, "Log times are drawn with standard deviations: participants' gains " +
                    fixed(model.gain_sd, 3) + ", their gains for single shapes beyond that " +
                    fixed(model.shape_gain_sd, 3) + ", single trials " +
                    fixed(model.residual_sd, 3) + "; " + percent(model.proportion_used) +
                    " of the trials give a time. " + std::to_string(settings.simulation.studies) +
                    " studies for each power (standard error of a power at most " +
                    percent(0.5 / std::sqrt(static_cast<double>(settings.simulation.studies))) +
                    "), seed " + std::to_string(settings.simulation.seed) +
                    ". For a shape without an effect the number is the rate of false positives.");
  for (const std::string& note : plan.notes) put_line(out, "Note: " + note);
  return out;
}

}  // namespace palpate::analysis
