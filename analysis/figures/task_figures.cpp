#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kDrawnParticipants = 12, kDrawnTracks = 4;
constexpr double kPanelWidth = 230, kPanelHeight = 170;

/// Least and greatest level with trials.
Interval levels_of(const ParticipantFunction& one) {
  Interval range{one.counts.front().level, one.counts.back().level};
  if (!(range.low < range.high)) range = {range.low - 0.5, range.high + 0.5};
  return range;
}

void add_curve_of(Panel& panel, const ParticipantFunction& one) {
  if (!one.fit.undefined.empty()) return;
  Mark line = line_mark(Role::ray, {}, {}, 2);
  for (int i = 0; i <= 100; ++i) {
    const double level = panel.x.low + (panel.x.high - panel.x.low) * i / 100;
    line.x.push_back(level);
    line.y.push_back(100 * psychometric_probability(one.model.function, one.fit.parameters, level));
  }
  panel.marks.push_back(std::move(line));
  const double threshold = one.fit.parameters.threshold;
  const double share =
      100 * psychometric_probability(one.model.function, one.fit.parameters, threshold);
  const auto shown = [&](double x) { return std::clamp(x, panel.x.low, panel.x.high); };
  add_interval_across(panel, Role::ink, share, shown(one.fit.threshold_ci95.low),
                      shown(one.fit.threshold_ci95.high),
                      "threshold with its 95 % interval, cut at the axis");
}

/// "level (N/m)"
std::string level_title(const std::string& unit) {
  return unit.empty() ? "level" : "level (" + printable(unit) + ")";
}

Panel function_panel(const ParticipantFunction& one, const std::string& unit) {
  Panel panel;
  panel.title = printable(one.participant);
  const Interval range = levels_of(one);
  panel.x = linear_axis(range.low, range.high, level_title(unit));
  panel.y = linear_axis(0, 100, "success (%)");
  panel.width = kPanelWidth;
  panel.height = kPanelHeight;
  int most = 1;
  for (const LevelCount& count : one.counts) most = std::max(most, count.trials);
  add_curve_of(panel, one);
  for (const LevelCount& count : one.counts) {
    const double size = 2 + 4 * std::sqrt(static_cast<double>(count.trials) / most);
    panel.marks.push_back(symbol(
        Role::point, MarkerShape::circle, count.level, 100.0 * count.successes / count.trials, size,
        std::to_string(count.successes) + " of " +
            counted(static_cast<std::size_t>(count.trials), "trial", "trials")));
  }
  return panel;
}

/// Levels in the order of a track: a circle for a success, a diamond for a reversal.
Panel track_panel(const ParticipantFunction& one, const Track& track, const std::string& unit) {
  Panel panel;
  panel.title = printable(one.participant);
  if (one.tracks.size() > 1) panel.title += ", track " + printable(track.name);
  const auto [low, high] = std::minmax_element(track.levels.begin(), track.levels.end());
  const double margin = *low < *high ? 0.06 * (*high - *low) : 0.5;
  panel.x = linear_axis(0, static_cast<double>(track.levels.size() + 1), "trial of the track");
  panel.y = linear_axis(*low - margin, *high + margin, level_title(unit));
  panel.width = kPanelWidth;
  panel.height = kPanelHeight;
  Mark line = line_mark(Role::soft, {}, {}, 1);
  for (std::size_t i = 0; i < track.levels.size(); ++i) {
    line.x.push_back(static_cast<double>(i + 1));
    line.y.push_back(track.levels[i]);
  }
  panel.marks.push_back(std::move(line));
  for (std::size_t i = 0; i < track.levels.size(); ++i) {
    const bool success = track.successes[i];
    const bool turned =
        std::find(track.reversals.begin(), track.reversals.end(), i) != track.reversals.end();
    const auto trial = static_cast<double>(i + 1);
    if (turned)
      panel.marks.push_back(symbol(Role::amber, MarkerShape::diamond, trial, track.levels[i], 6,
                                   "reversal at trial " + std::to_string(i + 1)));
    panel.marks.push_back(
        symbol(success ? Role::ray : Role::point,
               success ? MarkerShape::circle : MarkerShape::saltire, trial, track.levels[i], 3,
               "trial " + std::to_string(i + 1) + (success ? ": success" : ": no success")));
  }
  return panel;
}

/// "JND (N/m)"
std::string measure_title(const TaskGroup& group) {
  std::string name = measure_plural(group.measure);
  name.pop_back();
  return group.unit.empty() ? name : name + " (" + printable(group.unit) + ")";
}

/// Style of the n-th renderer of a group.
std::pair<Role, MarkerShape> group_style(const std::string& renderer, std::size_t n) {
  if (renderer == "point") return {Role::point, MarkerShape::circle};
  if (renderer == "ray") return {Role::ray, MarkerShape::square};
  constexpr Role kOthers[] = {Role::third, Role::fourth,  Role::fifth,
                              Role::sixth, Role::seventh, Role::eighth};
  constexpr MarkerShape kShapes[] = {MarkerShape::diamond, MarkerShape::up, MarkerShape::down};
  return {kOthers[n % std::size(kOthers)], kShapes[n % std::size(kShapes)]};
}

/// Of two participants an interval is some thirteen times their distance: it would hide them.
bool may_be_cut(const GroupMean& one) { return one.participants.size() < 3; }

/// Spans the participants' figures and the intervals; those of two participants at most by half the
/// range beyond.
FigureAxis group_axis(const TaskGroup& group) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const GroupMean& one : group.renderers) {
    for (const NamedFigure& figure : one.participants) {
      low = std::min(low, figure.value);
      high = std::max(high, figure.value);
    }
  }
  double range = std::max(high - low, 1e-3 * std::abs(high));
  const double least = low - 0.5 * range, most = high + 0.5 * range;
  for (const GroupMean& one : group.renderers) {
    if (!one.ci95) continue;
    const auto& [from, to] = *one.ci95;
    if (std::isfinite(from)) low = std::min(low, may_be_cut(one) ? std::max(from, least) : from);
    if (std::isfinite(to)) high = std::max(high, may_be_cut(one) ? std::min(to, most) : to);
  }
  range = std::max(range, high - low);
  const double margin = 0.08 * range;
  const bool all_above = low > 0;
  low -= margin;
  return linear_axis(all_above ? std::max(0.0, low) : low, high + margin, measure_title(group));
}

/// Each participant's figures are joined by a line.
void add_participants_of(Panel& panel, const TaskGroup& group) {
  std::map<std::string, Mark> lines;
  for (std::size_t r = 0; r < group.renderers.size(); ++r) {
    const auto [role, shape] = group_style(group.renderers[r].renderer, r);
    for (const NamedFigure& figure : group.renderers[r].participants) {
      Mark& line =
          lines.try_emplace(figure.participant, line_mark(Role::soft, {}, {}, 1)).first->second;
      line.x.push_back(static_cast<double>(r) + 0.62);
      line.y.push_back(figure.value);
      Mark dot =
          symbol(role, shape, line.x.back(), figure.value, 2.6,
                 printable(figure.participant) + ", " + printable(group.renderers[r].renderer) +
                     ": " + short_number(figure.value));
      dot.opacity = 0.7;
      panel.marks.push_back(std::move(dot));
    }
  }
  for (auto& [participant, line] : lines) {
    if (line.x.size() < 2) continue;
    line.opacity = 0.5;
    line.text = printable(participant);
    panel.marks.push_back(std::move(line));
  }
}

Panel group_panel(const TaskGroup& group) {
  std::vector<std::string> names;
  for (const GroupMean& one : group.renderers) names.push_back(one.renderer);
  Panel panel;
  panel.title = measure_plural(group.measure);
  panel.x = names_axis(names, names.size(), "renderer");
  panel.y = group_axis(group);
  panel.width = 110 + 70 * static_cast<double>(names.size());
  panel.height = 240;
  add_participants_of(panel, group);
  for (std::size_t r = 0; r < group.renderers.size(); ++r) {
    const GroupMean& one = group.renderers[r];
    if (!one.mean) continue;
    const auto [role, shape] = group_style(one.renderer, r);
    const double x = static_cast<double>(r) + 0.38;
    std::string text = printable(one.renderer) + ": mean " + short_number(*one.mean);
    if (one.ci95) {
      text +=
          ", 95 % interval " + short_number(one.ci95->low) + " to " + short_number(one.ci95->high);
      add_interval(panel, role, x, one.ci95->low, one.ci95->high, text);
    }
    panel.marks.push_back(symbol(role, shape, x, *one.mean, 6, text));
  }
  return panel;
}

/// "ray / point: 0.8 [0.7, 0.9], p 0.012 (6 pairs)"
std::string difference_sentence(const TaskComparison& one) {
  std::string text;
  for (const ConditionDifference& difference : one.comparison.differences) {
    if (difference.n_pairs == 0) continue;
    const auto shown = [&](double value) {
      return short_number(one.logarithms ? std::exp(value) : value);
    };
    text += measure_plural(one.measure) + ", " + printable(one.conditions[difference.condition]) +
            (one.logarithms ? " / " : " - ") + printable(one.conditions[0]) + ": " +
            shown(difference.mean);
    if (const auto& ends = difference.t_test.log_ratio_ci95)
      text += " [" + shown(ends->low) + ", " + shown(ends->high) + "]";
    if (difference.t_test.p) text += ", p " + p_text(*difference.t_test.p);
    text += " (paired, " + counted(difference.n_pairs, "participant", "participants") + "). ";
  }
  return text;
}

void add_group_figures(const TaskAnalysis& analysis, std::vector<Figure>& figures) {
  const auto same = [](const auto& a, const auto& b) {
    return a.task == b.task && a.block_name == b.block_name && a.shape == b.shape;
  };
  std::size_t number = 0;
  for (std::size_t i = 0; i < analysis.groups.size();) {
    const TaskGroup& first = analysis.groups[i];
    Figure figure;
    figure.title = "Over participants: " + first.task;
    for (const std::string* name : {&first.block_name, &first.shape}) {
      if (!name->empty()) figure.title += ", " + printable(*name);
    }
    if (analysis.table.simulated) figure.label = "SIMULATED PARTICIPANTS";
    figure.notes.push_back(
        "Large symbols: means over participants with their 95 % intervals (t), geometric if all "
        "values are ratios. Small symbols: participants, joined by a line.");
    std::size_t most = 0;
    bool cut = false;
    for (; i < analysis.groups.size() && same(analysis.groups[i], first); ++i) {
      const TaskGroup& group = analysis.groups[i];
      std::size_t shown = 0;
      figure.description += measure_plural(group.measure) + ": ";
      for (const GroupMean& one : group.renderers) {
        shown = std::max(shown, one.participants.size());
        figure.description +=
            printable(one.renderer) + " " + (one.mean ? short_number(*one.mean) : "no mean") + ". ";
      }
      if (shown > 0) figure.panels.push_back(group_panel(group));
      most = std::max(most, shown);
      cut |= std::ranges::any_of(group.renderers,
                                 [](const GroupMean& one) { return one.ci95 && may_be_cut(one); });
    }
    if (cut)
      figure.notes.push_back("An arrow: the interval of two participants goes on beyond the axis.");
    std::string differences;
    for (const TaskComparison& one : analysis.renderers) {
      if (same(one, first)) differences += difference_sentence(one);
    }
    if (!differences.empty()) figure.notes.push_back(differences);
    figure.subtitle = counted(most, "participant", "participants");
    if (figure.panels.empty()) continue;
    figure.id = "group" + std::to_string(++number);
    figures.push_back(std::move(figure));
  }
}

Figure figure_of(const TaskAnalysis& analysis, const TaskCell& cell, std::string id,
                 const std::string& what) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = what + ": " + cell.task;
  for (const std::string* name : {&cell.block_name, &cell.shape, &cell.renderer}) {
    if (!name->empty()) figure.title += ", " + printable(*name);
  }
  figure.subtitle = counted(cell.participants.size(), "participant", "participants") + ", " +
                    counted(cell.trials, "trial", "trials");
  if (analysis.table.simulated) figure.label = "SIMULATED PARTICIPANTS";
  if (cell.functions.size() > kDrawnParticipants)
    figure.notes.push_back("The first " + std::to_string(kDrawnParticipants) + " of " +
                           std::to_string(cell.functions.size()) + " participants.");
  return figure;
}

}  // namespace

std::vector<Figure> task_figures(const TaskAnalysis& analysis) {
  std::vector<Figure> figures;
  add_group_figures(analysis, figures);
  std::size_t number = 0;
  for (const TaskCell& cell : analysis.cells) {
    if (cell.functions.empty()) continue;
    const std::string suffix = std::to_string(++number);
    Figure functions = figure_of(analysis, cell, "function" + suffix, "Psychometric functions");
    Figure tracks = figure_of(analysis, cell, "track" + suffix, "Levels over the trials");
    functions.notes.insert(functions.notes.begin(),
                           "Circles: share of successes, larger for more trials. Line: "
                           "fitted function, with the 95 % interval of its threshold.");
    tracks.notes.insert(tracks.notes.begin(),
                        "Circles: successes (the comparison chosen, yes, different). Crosses: no "
                        "success. Diamonds: reversals of a staircase.");
    for (std::size_t i = 0; i < std::min(cell.functions.size(), kDrawnParticipants); ++i) {
      const ParticipantFunction& one = cell.functions[i];
      if (!one.counts.empty()) functions.panels.push_back(function_panel(one, cell.level_unit));
      for (std::size_t t = 0; t < std::min(one.tracks.size(), kDrawnTracks); ++t)
        tracks.panels.push_back(track_panel(one, one.tracks[t], cell.level_unit));
      functions.description +=
          printable(one.participant) + ": " +
          (one.fit.undefined.empty() ? "threshold " + fixed(one.fit.parameters.threshold, 4)
                                     : one.fit.undefined) +
          ". ";
    }
    tracks.description = functions.description;
    if (!functions.panels.empty()) figures.push_back(std::move(functions));
    if (!tracks.panels.empty()) figures.push_back(std::move(tracks));
  }
  return figures;
}

}  // namespace palpate::analysis
