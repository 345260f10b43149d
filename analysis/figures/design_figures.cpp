#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/study_design.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// Colour and symbol of a series: of a renderer its own.
LegendEntry series_entry(const std::string& renderer, std::size_t n) {
  if (renderer == "point") return {renderer, Role::point, MarkerShape::circle};
  if (renderer == "ray") return {renderer, Role::ray, MarkerShape::square};
  constexpr std::array kRoles{Role::third, Role::fourth, Role::fifth, Role::sixth};
  constexpr std::array kShapes{MarkerShape::diamond, MarkerShape::up, MarkerShape::down};
  return {renderer, kRoles[n % kRoles.size()], kShapes[n % kShapes.size()]};
}

double back(const GroupedMeasure& measure, double value) {
  return measure.logarithms ? std::exp(value) : value;
}

std::string axis_title(const GroupedMeasure& measure) {
  std::string name = measure.measure == "time"       ? "identification time"
                     : measure.measure == "accuracy" ? "share correct"
                                                     : measure_plural(measure.measure);
  return measure.unit.empty() ? name : name + " (" + printable(measure.unit) + ")";
}

/// The contents of a panel: at each place along x, the series side by side.
struct DesignPanel {
  const GroupedMeasure& measure;
  std::size_t factor = 0;      ///< within participants; its levels are series, or places
  bool places_groups = false;  ///< the places are groups and the series levels, or the reverse

  const StudyFactor& levels() const { return measure.within[factor]; }
  std::vector<std::string> groups() const {
    return measure.groups.empty() ? std::vector<std::string>{"all"} : measure.groups;
  }
  std::vector<std::string> places() const { return places_groups ? groups() : levels().levels; }
  std::vector<std::string> series() const { return places_groups ? levels().levels : groups(); }
  std::size_t group(std::size_t place, std::size_t series) const {
    return places_groups ? place : series;
  }
  DesignCondition condition(std::size_t place, std::size_t series) const {
    return {factor, places_groups ? series : place};
  }
  LegendEntry style(std::size_t series) const {
    return series_entry(this->series()[series], series);
  }
  double x(std::size_t place, std::size_t series) const {
    const auto n = static_cast<double>(this->series().size());
    const double step = std::min(0.34, 0.8 / n);
    return static_cast<double>(place) + 0.5 + (static_cast<double>(series) - (n - 1) / 2) * step;
  }
  /// A participant's figure; none: one of its cells is missing, or the participant is of another
  /// group.
  std::optional<double> value(const GroupedFigures& one, std::size_t place,
                              std::size_t series) const;
  /// The mean; with one level that over all.
  bool shows(const GroupMarginal& marginal, std::size_t place, std::size_t series) const {
    if (marginal.group != group(place, series)) return false;
    if (levels().levels.size() == 1) return !marginal.condition;
    return marginal.condition == condition(place, series);
  }
};

std::optional<double> DesignPanel::value(const GroupedFigures& one, std::size_t place,
                                         std::size_t series) const {
  if (one.group != group(place, series)) return std::nullopt;
  std::vector<double> cells;
  for (const std::optional<double>& cell : one.values) {
    if (!cell) return std::nullopt;
    cells.push_back(*cell);
  }
  std::vector<WithinFactor> within;
  for (const StudyFactor& of : measure.within) within.push_back({of.name, of.levels.size()});
  return back(measure, mean_of_condition(cells, within, condition(place, series)));
}

/// Spans the participants' figures and the intervals, in all panels alike.
FigureAxis value_axis(const GroupedMeasure& measure, const std::vector<DesignPanel>& panels) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto add = [&](double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const DesignPanel& shown : panels) {
    for (const GroupedFigures& one : measure.figures) {
      for (std::size_t x = 0; x < shown.places().size(); ++x) {
        for (std::size_t s = 0; s < shown.series().size(); ++s) {
          if (const auto value = shown.value(one, x, s)) add(*value);
        }
      }
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

void add_people(Panel& panel, const DesignPanel& shown) {
  const GroupedMeasure& measure = shown.measure;
  for (std::size_t i = 0; i < std::min(measure.figures.size(), kShownParticipants); ++i) {
    const GroupedFigures& one = measure.figures[i];
    for (std::size_t x = 0; x < shown.places().size(); ++x) {
      for (std::size_t s = 0; s < shown.series().size(); ++s) {
        const auto value = shown.value(one, x, s);
        if (!value) continue;
        const LegendEntry style = shown.style(s);
        Mark dot = symbol(style.role, style.shape, shown.x(x, s) + 0.1, *value, 2.6,
                          printable(one.participant) + ": " + short_number(*value));
        dot.opacity = 0.55;
        dot.participant = one.participant;
        panel.marks.push_back(std::move(dot));
      }
    }
  }
}

void add_means(Panel& panel, const DesignPanel& shown, std::string& description) {
  const GroupedMeasure& measure = shown.measure;
  for (std::size_t s = 0; s < shown.series().size(); ++s) {
    const LegendEntry style = shown.style(s);
    Mark line = line_mark(style.role, {}, {}, 1.5);
    std::vector<Mark> symbols;
    for (std::size_t x = 0; x < shown.places().size(); ++x) {
      const auto found =
          std::ranges::find_if(measure.result.marginals,
                               [&](const GroupMarginal& one) { return shown.shows(one, x, s); });
      if (found == measure.result.marginals.end() || !found->mean) continue;
      const double at = shown.x(x, s) - 0.05, y = back(measure, *found->mean);
      std::string text = printable(shown.places()[x]) + ", " + printable(shown.series()[s]) + ": " +
                         short_number(y);
      if (found->ci95) {
        const double low = back(measure, found->ci95->low), high = back(measure, found->ci95->high);
        text += ", 95 % interval " + short_number(low) + " to " + short_number(high);
        add_interval(panel, style.role, at, low, high, text);
      }
      description += text + ". ";
      line.x.push_back(at);
      line.y.push_back(y);
      symbols.push_back(symbol(style.role, style.shape, at, y, 6, text));
    }
    line.opacity = 0.6;
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    for (Mark& mark : symbols) panel.marks.push_back(std::move(mark));
  }
}

/// The panels of a measure: without crossed factors the groups with each renderer, else one for
/// each factor.
std::vector<DesignPanel> panels_of(const GroupedMeasure& measure) {
  if (!measure.crossed) return {{measure, 0, true}};
  std::vector<DesignPanel> out;
  for (std::size_t f = 0; f < measure.within.size(); ++f) {
    const bool of_shapes = f > 0 && measure.within[f].name == "shape";
    if (measure.within[f].levels.size() > 1 && !of_shapes) out.push_back({measure, f, false});
  }
  return out;
}

/// A figure of the measures of a stimulus in a block, or of identification.
Figure begin_figure(const StudyAnalysis& analysis, const GroupedMeasure& measure,
                    std::size_t number) {
  Figure figure;
  figure.id = "between" + std::to_string(number);
  figure.title = std::string(measure.crossed ? "Factors: " : "Groups: ") +
                 (measure.task.empty() ? "identification" : measure.task);
  for (const std::string* const name : {&measure.block_name, &measure.shape}) {
    if (!name->empty()) figure.title += ", " + printable(*name);
  }
  figure.subtitle = counted(measure.figures.size() - measure.result.dropped.size(), "participant",
                            "participants");
  if (analysis.table.simulated) figure.label = "SIMULATED PARTICIPANTS";
  figure.notes.emplace_back(
      "Large symbols: means over participants with their 95 % intervals (t), geometric if all "
      "values "
      "are ratios. Small symbols: participants.");
  const DesignPanel shown = panels_of(measure).front();
  for (std::size_t s = 0; shown.series().size() > 1 && s < shown.series().size(); ++s)
    figure.legend.push_back(shown.style(s));
  return figure;
}

}  // namespace

std::vector<Figure> between_figures(const StudyAnalysis& analysis) {
  std::vector<Figure> figures;
  const GroupedMeasure* before = nullptr;
  for (const GroupedMeasure& measure : analysis.by_design) {
    if (!measure.result.anova.undefined.empty()) continue;
    const bool continues = before != nullptr && before->task == measure.task &&
                           before->block_name == measure.block_name &&
                           before->shape == measure.shape;
    if (!continues) figures.push_back(begin_figure(analysis, measure, figures.size() + 1));
    before = &measure;
    Figure& figure = figures.back();
    const std::vector<DesignPanel> panels = panels_of(measure);
    for (const DesignPanel& shown : panels) {
      Panel panel;
      panel.title = axis_title(measure);
      panel.x = names_axis(shown.places(), shown.places().size(),
                           shown.places_groups ? "group" : printable(shown.levels().name));
      panel.y = value_axis(measure, panels);
      panel.width = 110 + 110 * static_cast<double>(shown.places().size());
      panel.height = 260;
      add_people(panel, shown);
      figure.description += panel.title + ": ";
      add_means(panel, shown, figure.description);
      figure.panels.push_back(std::move(panel));
    }
  }
  return figures;
}

}  // namespace palpate::analysis
