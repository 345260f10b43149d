#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/comparison.h"
#include "analysis/statistics/sweep_analysis.h"
#include "analysis/text.h"
#include "data/base/random.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kShownPoints = 400;  // of a scatter
constexpr double kLowestGain = -100;       // %; axes are cut there, as losses are unbounded

/// "" if all points are drawn.
std::string thinned_note(const SweepAnalysis& analysis) {
  if (analysis.table.rows() <= kShownPoints) return "";
  return "At most " + std::to_string(kShownPoints) + " of the points are drawn, chosen at random. ";
}

Figure sweep_figure(const SweepAnalysis& analysis, std::string id, std::string title) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = std::move(title);
  figure.label = "SIMULATED PARTICIPANTS";
  figure.subtitle =
      counted(analysis.table.rows() - analysis.n_failed, "point", "points") + " (" +
      analysis.table.design + "), " +
      counted(static_cast<std::size_t>(analysis.table.participants), "participant",
              "participants") +
      " and " +
      counted(static_cast<std::size_t>(analysis.table.repetitions), "repetition", "repetitions") +
      " each";
  return figure;
}

std::string gain_axis_title(const SweepTable& table) {
  return table.renderers.size() == 2 ? "less time with the " + table.renderers[1] + " (%)"
                                     : "gain (%)";
}

std::size_t shown_shapes_of(const SweepAnalysis& analysis, Figure& figure) {
  const std::size_t all = analysis.table.shapes.size(), n = std::min(all, kShownShapes);
  if (n < all)
    figure.notes.push_back("The first " + std::to_string(n) + " of " + std::to_string(all) +
                           " shapes.");
  return n;
}

const PaperEffect* paper_mark(const SweepAnalysis& analysis, const std::string& shape) {
  const bool compared = analysis.table.renderers == std::vector<std::string>{"point", "ray"};
  return compared ? find_paper_effect(shape) : nullptr;
}

void add_paper_mark(Panel& panel, const PaperEffect& effect, double x) {
  if (effect.percent_reduction) {
    panel.marks.push_back(symbol(Role::paper, MarkerShape::diamond, x, *effect.percent_reduction, 7,
                                 std::string(effect.shape) + ", Ho et al. 2000: " +
                                     fixed(*effect.percent_reduction, 0) + " %"));
    return;
  }
  Mark text = text_mark(Role::paper, x, 0, "n.s.", 12);
  text.bold = true;
  text.dy = -6;
  panel.marks.push_back(std::move(text));
}

/// Rows with a value, ascending. Beyond kShownPoints, a random sample with equal probabilities:
/// regular thinning would show only a part of a periodic design.
std::vector<std::size_t> shown_rows(const SweepAnalysis& analysis,
                                    const std::vector<double>& values) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (!std::isnan(values[row])) rows.push_back(row);
  }
  if (rows.size() <= kShownPoints) return rows;
  Random random(analysis.seed, {2});
  random.shuffle(rows);
  rows.resize(kShownPoints);
  std::sort(rows.begin(), rows.end());
  return rows;
}

/// Points spread over a strip by the golden section: evenly and reproducibly.
void add_strip(Panel& panel, const SweepAnalysis& analysis, const std::vector<double>& values,
               double centre) {
  const std::vector<std::size_t> rows = shown_rows(analysis, values);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double gain = values[rows[i]];
    if (gain < panel.y.low || gain > panel.y.high) continue;
    const double part = std::fmod(static_cast<double>(i) * 0.6180339887498949, 1.0);
    Mark dot = symbol(Role::ray, MarkerShape::circle, centre + 0.22 * (part - 0.5), gain, 1.8);
    dot.opacity = 0.35;
    panel.marks.push_back(std::move(dot));
  }
}

void add_box(Panel& panel, const Spread& spread, const std::string& text, double x) {
  const auto inside = [&](double y) { return std::clamp(y, panel.y.low, panel.y.high); };
  add_interval(panel, Role::ink, x, *spread.q05, *spread.q95, text);
  panel.marks.push_back(rect_mark(Role::ink, x - 0.07, inside(*spread.q25), x + 0.07,
                                  inside(*spread.q75), 0.35, text));
  panel.marks.push_back(symbol(Role::ink, MarkerShape::circle, x, inside(*spread.q50), 5.5, text));
}

Figure gains_figure(const SweepAnalysis& analysis) {
  Figure figure = sweep_figure(analysis, "gains", "Gains over the space of settings");
  if (analysis.table.shapes.empty()) return figure;  // of tasks: no gains
  const std::size_t shapes = shown_shapes_of(analysis, figure);
  double low = 0, high = 25;
  for (std::size_t s = 0; s < shapes; ++s) {
    if (analysis.gains[s].n == 0) continue;
    low = std::min(low, *analysis.gains[s].least);
    high = std::max(high, *analysis.gains[s].greatest);
  }
  Panel panel;
  panel.x = names_axis(analysis.table.shapes, shapes, "");
  panel.y = linear_axis(std::max(low, kLowestGain), high, gain_axis_title(analysis.table));
  panel.width = std::max(620.0, 90.0 * static_cast<double>(shapes));
  panel.height = 360;
  panel.marks.push_back(line_mark(Role::soft, {0, panel.x.high}, {0, 0}, 1.4));
  bool with_paper = false;
  for (std::size_t s = 0; s < shapes; ++s) {
    const Spread& spread = analysis.gains[s];
    const std::string& shape = analysis.table.shapes[s];
    const auto at = static_cast<double>(s);
    if (spread.n > 0) {
      const std::string text = shape + ": median " + fixed(*spread.q50, 1) +
                               " %, middle 50 % of the settings " + fixed(*spread.q25, 1) + " to " +
                               fixed(*spread.q75, 1) + " %, middle 90 % " + fixed(*spread.q05, 1) +
                               " to " + fixed(*spread.q95, 1) + " %";
      add_strip(panel, analysis, analysis.drivers[s].values, at + 0.3);
      add_box(panel, spread, text, at + 0.53);
      figure.description += text + ". ";
    }
    if (const PaperEffect* effect = paper_mark(analysis, shape)) {
      add_paper_mark(panel, *effect, at + 0.76);
      with_paper = true;
    }
  }
  figure.panels.push_back(std::move(panel));
  figure.legend = {{"a setting", Role::ray, MarkerShape::circle},
                   {"median of the settings", Role::ink, MarkerShape::circle}};
  if (with_paper) figure.legend.push_back({"Ho et al. 2000", Role::paper, MarkerShape::diamond});
  figure.notes.insert(
      figure.notes.begin(),
      thinned_note(analysis) + "Each small mark is a study at one point of the " +
          (analysis.table.design == "grid" ? "grid" : "space") +
          "; box: middle 50 %; bar: middle 90 %." +
          std::string(with_paper ? " n.s.: the paper found no significant difference." : ""));
  return figure;
}

struct Shown {
  double value = 0;
  std::optional<Interval> ci95;
};

/// The marks of a parameter in the drivers' figure: the outer and the inner one.
Shown outer(const Drivers& drivers, std::size_t p) {
  if (drivers.sobol)
    return {drivers.sobol->of[p].total.value_or(0), drivers.sobol->of[p].total_ci95};
  const RankCorrelation& one = drivers.ranks[p];
  if (one.partial) return {*one.partial, one.partial_ci95};
  return {one.spearman.value_or(0), one.spearman_ci95};
}
std::optional<double> inner(const Drivers& drivers, std::size_t p) {
  if (drivers.sobol) return drivers.sobol->of[p].first;
  return drivers.ranks[p].partial ? drivers.ranks[p].spearman : std::nullopt;
}

bool has_partial(const SweepAnalysis& analysis) {
  return std::any_of(analysis.drivers.begin(), analysis.drivers.end(), [](const Drivers& drivers) {
    return std::any_of(drivers.ranks.begin(), drivers.ranks.end(),
                       [](const RankCorrelation& one) { return one.partial.has_value(); });
  });
}

std::string title_of(const std::string& output) {
  return output.starts_with("gain_") ? output.substr(5) : output;
}

Panel drivers_panel(const SweepAnalysis& analysis, const Drivers& drivers) {
  const std::size_t n = std::min(drivers.strongest.size(), kShownDrivers);
  Panel panel;
  panel.title = title_of(drivers.output);
  panel.width = 330;
  panel.height = 30.0 * static_cast<double>(n) + 20;
  panel.x = drivers.sobol ? linear_axis(0, 1, driver_measure(analysis))
                          : linear_axis(-1, 1, driver_measure(analysis));
  std::vector<std::string> names;
  for (std::size_t i = n; i-- > 0;)
    names.push_back(analysis.table.parameters[drivers.strongest[i]]);
  panel.y = names_axis(names, n, "");
  const auto inside = [&](double x) { return std::clamp(x, panel.x.low, panel.x.high); };
  panel.marks.push_back(line_mark(Role::soft, {0, 0}, {0, panel.y.high}, 1.2));
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t p = drivers.strongest[i];
    const double y = static_cast<double>(n - 1 - i) + 0.5;
    const Shown shown = outer(drivers, p);
    std::string text =
        panel.title + ", " + analysis.table.parameters[p] + ": " + fixed(shown.value, 2);
    if (shown.ci95) {
      text += ", 95 % interval " + fixed(shown.ci95->low, 2) + " to " + fixed(shown.ci95->high, 2);
      add_interval_across(panel, Role::ink, y, shown.ci95->low, shown.ci95->high, text);
    }
    panel.marks.push_back(
        symbol(Role::ink, MarkerShape::circle, inside(shown.value), y, 5.5, text));
    if (const auto second = inner(drivers, p)) {
      panel.marks.push_back(symbol(Role::ray, MarkerShape::square, inside(*second), y, 3.8,
                                   (drivers.sobol ? "alone: " : "Spearman: ") + fixed(*second, 2)));
    }
  }
  return panel;
}

/// States whether the total indices include chance within the points.
std::string note_on_chance(const SweepAnalysis& analysis) {
  std::string with;
  for (const Drivers& drivers : analysis.drivers) {
    if (drivers.strongest.empty() || drivers.sobol->noise_share) continue;
    with += (with.empty() ? "" : ", ") + title_of(drivers.output);
  }
  return with.empty()
             ? "The indices do not include chance within the points."
             : "The total indices of these include chance within the points: " + with + ".";
}

Figure drivers_figure(const SweepAnalysis& analysis) {
  Figure figure = sweep_figure(analysis, "drivers", "Drivers of the gains");
  for (const Drivers& drivers : analysis.drivers) {
    if (drivers.strongest.empty() || figure.panels.size() > kShownShapes) continue;
    figure.panels.push_back(drivers_panel(analysis, drivers));
    figure.panels.back().starts_row = figure.panels.size() % 2 == 1;
    figure.description += title_of(drivers.output) + ": strongest " +
                          analysis.table.parameters[drivers.strongest[0]] + ". ";
  }
  if (figure.panels.empty()) return figure;
  if (analysis.table.design == "saltelli") {
    figure.legend = {{"with interactions (total)", Role::ink, MarkerShape::circle},
                     {"alone (first order)", Role::ray, MarkerShape::square}};
    figure.notes = {"Shares of the variance over the space, with 95 % bootstrap intervals. " +
                    note_on_chance(analysis)};
  } else {
    figure.legend = {{"partial, adjusted for the others", Role::ink, MarkerShape::circle},
                     {"Spearman", Role::ray, MarkerShape::square}};
    if (!has_partial(analysis)) figure.legend = {{"Spearman", Role::ink, MarkerShape::circle}};
    figure.notes = {
        "Rank correlations of the gain with each parameter, with 95 % intervals; below 0: the "
        "larger the "
        "parameter, the smaller the gain."};
  }
  figure.notes.push_back("The " + std::to_string(kShownDrivers) +
                         " strongest of each; the tables are complete.");
  return figure;
}

FigureAxis parameter_axis(const SweepTable& table, std::size_t parameter) {
  const std::vector<double>& values = table.values[parameter];
  if (!table.words[parameter].empty()) {
    FigureAxis axis = names_axis(table.words[parameter], table.words[parameter].size(),
                                 table.parameters[parameter]);
    for (Tick& tick : axis.ticks) tick.at -= 0.5;
    axis.low = -0.5;
    axis.high = static_cast<double>(table.words[parameter].size()) - 0.5;
    return axis;
  }
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return linear_axis(*low, *high, table.parameters[parameter]);
}

Panel scatter_panel(const SweepAnalysis& analysis, const Drivers& drivers) {
  const SweepTable& table = analysis.table;
  const std::size_t parameter = drivers.strongest.front();
  Panel panel;
  panel.title = title_of(drivers.output);
  panel.width = 370;
  panel.height = 260;
  panel.x = parameter_axis(table, parameter);
  double low = 0, high = 10;
  for (const double gain : drivers.values) {
    if (std::isnan(gain)) continue;
    low = std::min(low, gain);
    high = std::max(high, gain);
  }
  panel.y = linear_axis(std::max(low, kLowestGain), high, gain_axis_title(table));
  panel.marks.push_back(line_mark(Role::soft, {panel.x.low, panel.x.high}, {0, 0}, 1.2));
  for (const std::size_t i : shown_rows(analysis, drivers.values)) {
    const double gain = drivers.values[i];
    if (gain < panel.y.low) continue;
    Mark dot = symbol(Role::ray, MarkerShape::circle, table.values[parameter][i], gain, 2.4,
                      "point " + std::to_string(table.points[i]) + ": " + fixed(gain, 1) + " %");
    dot.opacity = 0.5;
    panel.marks.push_back(std::move(dot));
  }
  return panel;
}

Figure scatter_figure(const SweepAnalysis& analysis) {
  Figure figure = sweep_figure(analysis, "scatter", "Each gain against its strongest driver");
  for (std::size_t s = 0; s < std::min(analysis.table.shapes.size(), kShownShapes); ++s) {
    if (analysis.drivers[s].strongest.empty()) continue;
    figure.panels.push_back(scatter_panel(analysis, analysis.drivers[s]));
    figure.panels.back().starts_row = figure.panels.size() % 2 == 1;
    figure.description += analysis.table.shapes[s] + " over " + figure.panels.back().x.title + ". ";
  }
  figure.legend = {{"a setting", Role::ray, MarkerShape::circle}};
  figure.notes = {thinned_note(analysis) + "A loss of more than 100 % is not drawn."};
  return figure;
}

}  // namespace

std::string driver_measure(const SweepAnalysis& analysis) {
  return analysis.table.design == "saltelli" ? "Sobol index" : "rank correlation";
}

std::vector<Figure> sweep_figures(const SweepAnalysis& analysis) {
  std::vector<Figure> out;
  for (Figure figure :
       {gains_figure(analysis), drivers_figure(analysis), scatter_figure(analysis)}) {
    if (!figure.panels.empty()) out.push_back(std::move(figure));
  }
  return out;
}

}  // namespace palpate::analysis
