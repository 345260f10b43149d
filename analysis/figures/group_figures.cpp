#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/study_groups.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// Colour and symbol of a renderer, or of the only one.
LegendEntry entry_of(const std::string& renderer, std::size_t n) {
  if (renderer == "point") return {renderer, Role::point, MarkerShape::circle};
  if (renderer == "ray") return {renderer, Role::ray, MarkerShape::square};
  constexpr std::array kRoles{Role::third, Role::fourth, Role::fifth, Role::sixth};
  constexpr std::array kShapes{MarkerShape::diamond, MarkerShape::up, MarkerShape::down};
  return {renderer, kRoles[n % kRoles.size()], kShapes[n % kShapes.size()]};
}

/// A participant's figure with a renderer: the mean over its cells; none: one is missing.
std::optional<double> value_of(const GroupedMeasure& measure, const GroupedFigures& one,
                               std::size_t renderer) {
  const std::size_t cells = one.values.size() / measure.renderers.size();
  double sum = 0;
  for (std::size_t i = renderer * cells; i < (renderer + 1) * cells; ++i) {
    if (!one.values[i]) return std::nullopt;
    sum += *one.values[i];
  }
  const double mean = sum / static_cast<double>(cells);
  return measure.logarithms ? std::exp(mean) : mean;
}

double back(const GroupedMeasure& measure, double value) {
  return measure.logarithms ? std::exp(value) : value;
}

/// Whether the marginal is of this renderer; with one renderer it is that over all.
bool is_of(const GroupedMeasure& measure, const GroupMarginal& marginal, std::size_t renderer) {
  if (measure.renderers.size() == 1) return !marginal.condition;
  return marginal.condition == renderer;
}

std::string axis_title(const GroupedMeasure& measure) {
  std::string name = measure.measure == "time"       ? "identification time"
                     : measure.measure == "accuracy" ? "share correct"
                                                     : measure_plural(measure.measure);
  return measure.unit.empty() ? name : name + " (" + printable(measure.unit) + ")";
}

/// Where renderer r of group g stands: side by side in the group's slot.
double place_of(const GroupedMeasure& measure, std::size_t group, std::size_t renderer) {
  const auto n = static_cast<double>(measure.renderers.size());
  const double step = std::min(0.34, 0.8 / n);
  return static_cast<double>(group) + 0.5 + (static_cast<double>(renderer) - (n - 1) / 2) * step;
}

/// Spans the participants' figures and the intervals.
FigureAxis value_axis(const GroupedMeasure& measure) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto add = [&](double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const GroupedFigures& one : measure.figures) {
    for (std::size_t r = 0; r < measure.renderers.size(); ++r) {
      if (const auto value = value_of(measure, one, r)) add(*value);
    }
  }
  const double range = std::max(high - low, 1e-3 * std::abs(high));
  const double least = low - 0.5 * range, most = high + 0.5 * range;
  for (const GroupMarginal& one : measure.result.marginals) {
    if (!one.ci95) continue;
    add(std::max(back(measure, one.ci95->low), least));
    add(std::min(back(measure, one.ci95->high), most));
  }
  const double margin = 0.08 * (high - low);
  return linear_axis(low > 0 ? std::max(0.0, low - margin) : low - margin, high + margin,
                     axis_title(measure));
}

void add_people(Panel& panel, const GroupedMeasure& measure) {
  for (std::size_t i = 0; i < std::min(measure.figures.size(), kShownParticipants); ++i) {
    const GroupedFigures& one = measure.figures[i];
    for (std::size_t r = 0; r < measure.renderers.size(); ++r) {
      const auto value = value_of(measure, one, r);
      if (!value) continue;
      const LegendEntry style = entry_of(measure.renderers[r], r);
      Mark dot = symbol(style.role, style.shape, place_of(measure, one.group, r) + 0.1, *value, 2.6,
                        printable(one.participant) + ": " + short_number(*value));
      dot.opacity = 0.55;
      dot.participant = one.participant;
      panel.marks.push_back(std::move(dot));
    }
  }
}

void add_means(Panel& panel, const GroupedMeasure& measure, std::string& description) {
  for (std::size_t r = 0; r < measure.renderers.size(); ++r) {
    const LegendEntry style = entry_of(measure.renderers[r], r);
    Mark line = line_mark(style.role, {}, {}, 1.5);
    std::vector<Mark> symbols;
    for (const GroupMarginal& one : measure.result.marginals) {
      if (!is_of(measure, one, r) || !one.mean) continue;
      const double x = place_of(measure, one.group, r) - 0.05, y = back(measure, *one.mean);
      std::string text = printable(measure.groups[one.group]) + ", " +
                         printable(measure.renderers[r]) + ": " + short_number(y);
      if (one.ci95) {
        const double low = back(measure, one.ci95->low), high = back(measure, one.ci95->high);
        text += ", 95 % interval " + short_number(low) + " to " + short_number(high);
        add_interval(panel, style.role, x, low, high, text);
      }
      description += text + ". ";
      line.x.push_back(x);
      line.y.push_back(y);
      symbols.push_back(symbol(style.role, style.shape, x, y, 6, text));
    }
    line.opacity = 0.6;
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    for (Mark& mark : symbols) panel.marks.push_back(std::move(mark));
  }
}

/// A figure of the measures of a stimulus in a block, or of identification.
Figure begin_figure(const StudyAnalysis& analysis, const GroupedMeasure& measure,
                    std::size_t number) {
  Figure figure;
  figure.id = "between" + std::to_string(number);
  figure.title = "Groups: " + (measure.task.empty() ? "identification" : measure.task);
  for (const std::string* const name : {&measure.block_name, &measure.shape}) {
    if (!name->empty()) figure.title += ", " + printable(*name);
  }
  figure.subtitle = counted(measure.figures.size(), "participant", "participants");
  if (analysis.table.simulated) figure.label = "SIMULATED PARTICIPANTS";
  figure.notes.emplace_back(
      "Large symbols: means of the group with their 95 % intervals (t), geometric if all values "
      "are ratios. Small symbols: participants.");
  for (std::size_t r = 0; measure.renderers.size() > 1 && r < measure.renderers.size(); ++r)
    figure.legend.push_back(entry_of(measure.renderers[r], r));
  return figure;
}

}  // namespace

std::vector<Figure> between_figures(const StudyAnalysis& analysis) {
  std::vector<Figure> figures;
  const GroupedMeasure* before = nullptr;
  for (const GroupedMeasure& measure : analysis.between_groups) {
    if (!measure.result.anova.undefined.empty()) continue;
    const bool continues = before != nullptr && before->task == measure.task &&
                           before->block_name == measure.block_name &&
                           before->shape == measure.shape;
    if (!continues) figures.push_back(begin_figure(analysis, measure, figures.size() + 1));
    before = &measure;
    Figure& figure = figures.back();
    Panel panel;
    panel.title = axis_title(measure);
    panel.x = names_axis(measure.groups, measure.groups.size(), "group");
    panel.y = value_axis(measure);
    panel.width = 110 + 110 * static_cast<double>(measure.groups.size());
    panel.height = 260;
    add_people(panel, measure);
    figure.description += panel.title + ": ";
    add_means(panel, measure, figure.description);
    figure.panels.push_back(std::move(panel));
  }
  return figures;
}

}  // namespace palpate::analysis
