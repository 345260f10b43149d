#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/report/plan_report.h"
#include "analysis/text.h"

namespace palpate::analysis {

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
      "A line for each number of trials of each shape with each renderer. The number at a line: "
      "the fewest participants with the wanted power."};
  return figure;
}

}  // namespace palpate::analysis
