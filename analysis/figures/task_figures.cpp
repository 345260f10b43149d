#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"
#include "data/base/cell_name.h"

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
std::string group_title(const TaskGroup& group) {
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
bool may_be_cut(const GroupMean& one) { return !one.of_model && one.participants.size() < 3; }

bool first_of_model(const TaskGroup& group) {
  return !group.renderers.empty() && group.renderers.front().of_model;
}

/// Spans the participants' figures and the intervals; those of two participants at most by half the
/// range beyond.
FigureAxis group_axis(const TaskGroup& group) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const GroupMean& one : group.renderers) {
    for (const NamedFigure& figure : one.participants) {
      low = std::min(low, figure.value);
      high = std::max(high, figure.value);
    }
    if (one.mean) {
      low = std::min(low, *one.mean);
      high = std::max(high, *one.mean);
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
  return linear_axis(all_above ? std::max(0.0, low) : low, high + margin, group_title(group));
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
      dot.opacity = group.renderers[r].of_model ? 0.45 : 0.7;
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

/// "JNDs, ray / point: 0.5 [0.3, 0.86], p 0.012 (hierarchical model, 8 participants)"
std::string difference_sentence(const TaskGroupComparison& one) {
  if (!one.estimate) return "";
  std::string text = measure_plural(one.measure) + ", " + printable(one.compared) +
                     (one.ratio ? " / " : " - ") + printable(one.reference) + ": " +
                     short_number(*one.estimate);
  text += " [" + (one.low ? short_number(*one.low) : "open") + ", " +
          (one.high ? short_number(*one.high) : "open") + "]";
  return text + ", p " + p_text(*one.p) + " (hierarchical model, " +
         counted(one.n, "participant", "participants") + "). ";
}

void add_design_figures(const StudyAnalysis& analysis, std::vector<Figure>& figures) {
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
        first_of_model(first)
            ? "Large symbols: the group by a hierarchical model of all answers, with 95 % "
              "intervals. "
              "Small symbols: functions fitted singly, not used for it."
            : "Large symbols: means over participants with their 95 % intervals (t), geometric if "
              "all values are ratios. Small symbols: participants, joined by a line.");
    std::size_t most = 0;
    bool cut = false;
    for (; i < analysis.groups.size() && same(analysis.groups[i], first); ++i) {
      const TaskGroup& group = analysis.groups[i];
      if (group.measure == "rating") continue;  // all stimuli of a block have one figure
      std::size_t shown = 0;
      figure.description += measure_plural(group.measure) + ": ";
      for (const GroupMean& one : group.renderers) {
        shown = std::max({shown, one.participants.size(), one.n_of_model});
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
    for (const TaskGroupComparison& one : analysis.group_models.comparisons) {
      if (same(one, first)) differences += difference_sentence(one);
    }
    for (const TaskComparison& one : analysis.renderers) {
      if (same(one, first) && !first_of_model(first)) differences += difference_sentence(one);
    }
    if (!differences.empty()) figure.notes.push_back(differences);
    figure.subtitle = counted(most, "participant", "participants");
    if (figure.panels.empty()) continue;
    figure.id = "group" + std::to_string(++number);
    figures.push_back(std::move(figure));
  }
}

/// A figure of cells: titled by what they have in common.
Figure new_task_figure(const StudyAnalysis& analysis, std::string id, const std::string& title,
                       const TaskCell& cell, const std::string& shape) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = title + ": " + cell.task;
  for (const std::string* name : {&cell.block_name, &shape}) {
    if (!name->empty()) figure.title += ", " + printable(*name);
  }
  figure.subtitle = counted(cell.participants.size(), "participant", "participants");
  if (analysis.table.simulated) figure.label = "SIMULATED PARTICIPANTS";
  return figure;
}

// Ratings.

/// Ratings of a stimulus, or at a level of it.
struct RatedPlace {
  double x = 0;
  std::string name;
  const MeanRating* mean = nullptr;
  const std::vector<ParticipantRatings>* participants = nullptr;
};

using CellList = std::vector<const TaskCell*>;

/// Cells with something to draw that agree in `key`, in order of their first.
template <class Key, class KeyOf>
std::vector<CellList> grouped_cells(const StudyAnalysis& analysis, bool (*has)(const TaskCell&),
                                    KeyOf key_of) {
  std::vector<CellList> groups;
  std::map<Key, std::size_t> places;
  for (const TaskCell& cell : analysis.cells) {
    if (!has(cell)) continue;
    const auto [place, is_new] = places.emplace(key_of(cell), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&cell);
  }
  return groups;
}

std::vector<std::string> distinct(const CellList& cells, std::string TaskCell::*name) {
  std::vector<std::string> names;
  for (const TaskCell* cell : cells) {
    if (std::ranges::find(names, cell->*name) == names.end()) names.push_back(cell->*name);
  }
  return names;
}

double place_of(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<double>(std::ranges::find(names, name) - names.begin());
}

/// Spans scale, participants and intervals.
FigureAxis rating_axis(const CellList& cells) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto take = [&](double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  const auto take_mean = [&](const MeanRating& mean,
                             const std::vector<ParticipantRatings>& participants) {
    for (const ParticipantRatings& one : participants) take(one.spread.mean);
    if (!mean.ci95 || participants.size() < 3) return;
    take(mean.ci95->low);
    take(mean.ci95->high);
  };
  for (const TaskCell* cell : cells) {
    for (const RatingStep& step : cell->ratings->steps) take(step.number);
    take_mean(cell->ratings->mean, cell->ratings->participants);
    for (const RatingsAtLevel& at : cell->ratings->levels) take_mean(at.mean, at.participants);
  }
  const double margin = 0.04 * std::max(high - low, 1e-3);
  return linear_axis(low - margin, high + margin, "rating");
}

void add_ratings(Panel& panel, const TaskCell& cell, const std::vector<RatedPlace>& places,
                 std::size_t renderer, bool joined_by_lines) {
  const auto [role, shape] = group_style(cell.renderer, renderer);
  std::map<std::size_t, Mark> lines;
  for (const RatedPlace& place : places) {
    for (const ParticipantRatings& one : *place.participants) {
      const std::string& person = cell.participants[one.participant];
      Mark dot = symbol(role, shape, place.x, one.spread.mean, 2.6,
                        printable(person) + ", " + place.name + ", " + printable(cell.renderer) +
                            ": mean " + short_number(one.spread.mean) + " of " +
                            counted(one.spread.ratings, "rating", "ratings"));
      dot.opacity = 0.35;
      dot.participant = printable(person, 40);
      if (!joined_by_lines) dot.dx = 7;
      panel.marks.push_back(std::move(dot));
      Mark& line = lines.try_emplace(one.participant, line_mark(role, {}, {}, 1)).first->second;
      line.participant = printable(person, 40);
      line.x.push_back(place.x);
      line.y.push_back(one.spread.mean);
    }
  }
  Mark group = line_mark(role, {}, {}, 3);
  for (auto& [participant, line] : lines) {
    line.opacity = 0.25;
    if (joined_by_lines && line.x.size() > 1) panel.marks.push_back(std::move(line));
  }
  for (const RatedPlace& place : places) {
    if (!place.mean->mean) continue;
    std::string text =
        place.name + ", " + printable(cell.renderer) + ": mean " + short_number(*place.mean->mean);
    if (const auto& ends = place.mean->ci95) {
      text += ", 95 % interval " + short_number(ends->low) + " to " + short_number(ends->high);
      add_interval(panel, role, place.x, ends->low, ends->high, text);
    }
    panel.marks.push_back(symbol(role, shape, place.x, *place.mean->mean, 6, text));
    group.x.push_back(place.x);
    group.y.push_back(*place.mean->mean);
  }
  if (joined_by_lines && group.x.size() > 1) panel.marks.push_back(std::move(group));
}

/// Means of all stimuli of a block side by side.
/// "silk", "smooth, large" of the cells of one stimulus, "silk: smooth, large" of several.
std::string place_label(const std::string& shape, const std::vector<std::string>& shapes) {
  const CellName name = cell_name(shape);
  if (name.levels.empty()) return printable(name.base);
  std::string levels;
  for (const auto& [factor, level] : name.levels)
    levels += (levels.empty() ? "" : ", ") + printable(level);
  const bool one = std::ranges::all_of(
      shapes, [&](const std::string& other) { return base_name(other) == name.base; });
  return one ? levels : printable(name.base) + ": " + levels;
}

Panel named_ratings_panel(const CellList& cells) {
  const std::vector<std::string> shapes = distinct(cells, &TaskCell::shape);
  const std::vector<std::string> renderers = distinct(cells, &TaskCell::renderer);
  std::vector<std::string> labels;
  labels.reserve(shapes.size());
  for (const std::string& shape : shapes) labels.push_back(place_label(shape, shapes));
  Panel panel;
  panel.title = "Mean ratings";
  panel.x = names_axis(labels, labels.size(), "");
  panel.y = rating_axis(cells);
  panel.width = std::min(900.0, 80 + 70 * static_cast<double>(shapes.size()));
  panel.height = 260;
  for (const TaskCell* cell : cells) {
    const double r = place_of(renderers, cell->renderer);
    const double apart = 0.6 / static_cast<double>(renderers.size());
    const double x = place_of(shapes, cell->shape) + 0.2 + (r + 0.4) * apart;
    add_ratings(
        panel, *cell,
        {{x, place_label(cell->shape, shapes), &cell->ratings->mean, &cell->ratings->participants}},
        static_cast<std::size_t>(r), false);
  }
  return panel;
}

/// Means over the levels of a stimulus.
Panel levels_panel(const CellList& cells, const std::string& shape) {
  const std::vector<std::string> renderers = distinct(cells, &TaskCell::renderer);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const TaskCell* cell : cells) {
    if (cell->shape != shape || cell->ratings->levels.empty()) continue;
    low = std::min(low, cell->ratings->levels.front().level);
    high = std::max(high, cell->ratings->levels.back().level);
  }
  Panel panel;
  panel.title = printable(shape, 40);
  panel.x = linear_axis(low, low < high ? high : low + 1, level_title(cells.front()->level_unit));
  panel.y = rating_axis(cells);
  panel.width = 400;
  panel.height = 260;
  for (const TaskCell* cell : cells) {
    if (cell->shape != shape) continue;
    std::vector<RatedPlace> places;
    for (const RatingsAtLevel& at : cell->ratings->levels)
      places.push_back({at.level, "level " + short_number(at.level), &at.mean, &at.participants});
    add_ratings(panel, *cell, places, static_cast<std::size_t>(place_of(renderers, cell->renderer)),
                true);
  }
  return panel;
}

/// Shares of the steps of each stimulus with a renderer, from the lowest step upwards.
Panel shares_panel(const CellList& cells, const std::string& renderer) {
  const std::vector<std::string> shapes = distinct(cells, &TaskCell::shape);
  Panel panel;
  panel.title = "Shares of the answers, " + printable(renderer, 40);
  panel.x = names_axis(shapes, shapes.size(), "");
  panel.y = linear_axis(0, 100, "share (%)");
  panel.width = std::min(900.0, 80 + 70 * static_cast<double>(shapes.size()));
  panel.height = 260;
  // One shade for a step in all columns: without labels each has the steps that occur in it.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const TaskCell* cell : cells) {
    for (const RatingStep& step : cell->ratings->steps) {
      low = std::min(low, step.number);
      high = std::max(high, step.number);
    }
  }
  for (const TaskCell* cell : cells) {
    if (cell->renderer != renderer) continue;
    const std::vector<RatingStep>& steps = cell->ratings->steps;
    const double x = place_of(shapes, cell->shape);
    double from = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const double to = from + 100 * steps[i].share;
      const double depth = 0.12 + 0.78 * (steps[i].number - low) / std::max(high - low, 1e-9);
      const std::string text = printable(cell->shape) + ", " + short_number(steps[i].number) +
                               (steps[i].label.empty() ? "" : " " + printable(steps[i].label)) +
                               ": " + fixed(100 * steps[i].share, 1) + " %";
      if (to > from)
        panel.marks.push_back(rect_mark(Role::point, x + 0.15, from, x + 0.85, to, depth, text));
      if (to - from >= 7) {
        Mark number = text_mark(depth > 0.72 ? Role::page : Role::ink, x + 0.5, 0.5 * (from + to),
                                short_number(steps[i].number), 12);
        number.dy = 4;
        panel.marks.push_back(std::move(number));
      }
      from = to;
    }
  }
  return panel;
}

void add_rating_figures(const StudyAnalysis& analysis, std::vector<Figure>& figures) {
  const auto has = [](const TaskCell& cell) {
    return cell.ratings && cell.ratings->spread.ratings > 0;
  };
  std::size_t number = 0;
  for (const CellList& cells : grouped_cells<std::string>(
           analysis, has, [](const TaskCell& cell) { return cell.block_name; })) {
    const TaskCell& first = *cells.front();
    Figure figure =
        new_task_figure(analysis, "rating" + std::to_string(++number), "Ratings", first, "");
    const std::vector<std::string> renderers = distinct(cells, &TaskCell::renderer);
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      const auto [role, shape] = group_style(renderers[r], r);
      figure.legend.push_back({printable(renderers[r], 40), role, shape});
    }
    if (first.ratings->levels.empty()) {
      figure.panels.push_back(named_ratings_panel(cells));
    } else {
      for (const std::string& shape : distinct(cells, &TaskCell::shape))
        figure.panels.push_back(levels_panel(cells, shape));
    }
    if (!first.ratings->steps.empty()) {
      for (const std::string& renderer : renderers) {
        figure.panels.push_back(shares_panel(cells, renderer));
        figure.panels.back().starts_row = renderer == renderers.front();
      }
    }
    figure.notes.push_back(
        "Large symbols: means over participants with their 95 % intervals (t). Small symbols: "
        "means of a participant's ratings.");
    std::string steps;
    for (const RatingStep& step : first.ratings->steps) {
      if (!step.label.empty())
        steps +=
            (steps.empty() ? "" : ", ") + short_number(step.number) + " " + printable(step.label);
    }
    if (!steps.empty()) figure.notes.push_back("Steps: " + steps + ".");
    for (const TaskCell* cell : cells)
      figure.description += printable(cell->shape) + ", " + printable(cell->renderer) + ": mean " +
                            short_number(*cell->ratings->mean.mean) + ", median " +
                            short_number(cell->ratings->spread.median) + ". ";
    figures.push_back(std::move(figure));
  }
}

// Magnitude estimation.

/// log10 of a participant's magnitudes, moved to the common mean.
struct Moved {
  const StevensLine* line = nullptr;
  double shift = 0;
};

std::vector<Moved> equalized(const MagnitudeEstimation& magnitude) {
  std::vector<Moved> moved;
  double common = 0;
  for (const StevensLine& line : magnitude.lines) {
    double own = 0;
    for (const StevensLine::Point& point : line.points)
      own += std::log10(point.magnitude) / static_cast<double>(line.points.size());
    moved.push_back({&line, -own});
    common += own / static_cast<double>(magnitude.lines.size());
  }
  for (Moved& one : moved) one.shift += common;
  return moved;
}

Panel magnitude_panel(const TaskCell& cell, std::size_t renderer) {
  const MagnitudeEstimation& magnitude = *cell.magnitude;
  const auto [role, shape] = group_style(cell.renderer, renderer);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto take = [&](double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  Panel panel;
  for (const auto& [line, shift] : equalized(magnitude)) {
    Mark mark = line_mark(Role::soft, {}, {}, 1);
    mark.opacity = 0.5;
    mark.participant = printable(cell.participants[line->participant], 40);
    mark.text = mark.participant + (line->exponent ? ": exponent " + short_number(*line->exponent)
                                                   : ": " + line->undefined);
    for (const StevensLine::Point& point : line->points) {
      mark.x.push_back(std::log10(point.level));
      mark.y.push_back(std::log10(point.magnitude) + shift);
      take(mark.y.back());
      Mark dot = symbol(Role::soft, shape, mark.x.back(), mark.y.back(), 2.2, mark.text);
      dot.participant = mark.participant;
      panel.marks.push_back(std::move(dot));
    }
    if (mark.x.size() > 1) panel.marks.push_back(std::move(mark));
  }
  for (const MagnitudeMean& one : magnitude.means) {
    if (!one.ci95 || one.participants < 3) continue;
    take(std::log10(one.ci95->low));
    take(std::log10(one.ci95->high));
  }
  const double margin = 0.05 * std::max(high - low, 0.1);
  panel.title = printable(cell.renderer, 40);
  const double first = std::log10(magnitude.means.front().level);
  const double last = std::log10(magnitude.means.back().level);
  const double beside = 0.05 * std::max(last - first, 0.1);
  panel.x = log_axis(first - beside, last + beside, level_title(cell.level_unit));
  panel.y = log_axis(low - margin, high + margin, "rating");
  panel.width = 360;
  panel.height = 280;
  Mark group = line_mark(role, {}, {}, 3);
  for (const MagnitudeMean& one : magnitude.means) {
    const double x = std::log10(one.level), y = std::log10(one.geometric_mean);
    std::string text =
        "level " + short_number(one.level) + ": geometric mean " + short_number(one.geometric_mean);
    if (one.ci95) {
      text +=
          ", 95 % interval " + short_number(one.ci95->low) + " to " + short_number(one.ci95->high);
      add_interval(panel, role, x, std::log10(one.ci95->low), std::log10(one.ci95->high), text);
    }
    panel.marks.push_back(symbol(role, shape, x, y, 6, text));
    group.x.push_back(x);
    group.y.push_back(y);
  }
  if (group.x.size() > 1) panel.marks.push_back(std::move(group));
  return panel;
}

void add_magnitude_figures(const StudyAnalysis& analysis, std::vector<Figure>& figures) {
  const auto has = [](const TaskCell& cell) {
    return cell.magnitude && !cell.magnitude->means.empty();
  };
  std::size_t number = 0;
  for (const CellList& cells : grouped_cells<std::pair<std::string, std::string>>(
           analysis, has,
           [](const TaskCell& cell) { return std::pair(cell.block_name, cell.shape); })) {
    const TaskCell& first = *cells.front();
    Figure figure = new_task_figure(analysis, "magnitude" + std::to_string(++number),
                                    "Ratings over levels", first, first.shape);
    for (std::size_t r = 0; r < cells.size(); ++r) {
      figure.panels.push_back(magnitude_panel(*cells[r], r));
      figure.description += printable(cells[r]->renderer) + ": ";
      for (const MagnitudeMean& one : cells[r]->magnitude->means)
        figure.description +=
            "level " + short_number(one.level) + " " + short_number(one.geometric_mean) + ". ";
    }
    figure.notes.push_back(
        "Both axes are logarithmic: a power law is a straight line. Thin: participants, moved to "
        "one mean of logarithms (modulus equalization). Bold: geometric means over participants "
        "with their 95 % intervals (t).");
    figures.push_back(std::move(figure));
  }
}

/// A measure of movements over the trials of their block.
struct ReachCourse {
  const char* title;
  std::vector<ReachPoint> Reaches::*points;
  double factor;  ///< of the drawn value
};
constexpr ReachCourse kDeviation{"deviation at peak speed (mm)", &Reaches::deviations, 1e3};
constexpr ReachCourse kCatches{"", &Reaches::catches, 1e3};
constexpr ReachCourse kAdaptation{"adaptation", &Reaches::adaptations, 1};

/// Means over participants in runs of trials, drawn at the middle of each.
void add_means(Panel& panel, const TaskCell& cell, const ReachCourse& course, double run, Role role,
               MarkerShape shape) {
  std::map<int, std::vector<double>> values;
  for (const Reaches& one : cell.reaches) {
    for (const ReachPoint& point : one.*course.points)
      values[static_cast<int>(point.trial / run)].push_back(course.factor * point.value);
  }
  Mark line = line_mark(role, {}, {}, 3);
  for (const auto& [number, own] : values) {
    double mean = 0;
    for (const double value : own) mean += value / static_cast<double>(own.size());
    const double at = (number + 0.5) * run + 0.5;
    line.x.push_back(at);
    line.y.push_back(mean);
    panel.marks.push_back(symbol(role, shape, at, mean, 4,
                                 "mean of " + counted(own.size(), "trial", "trials") + " about " +
                                     short_number(at) + ": " + short_number(mean)));
  }
  if (line.x.size() > 1) panel.marks.push_back(std::move(line));
}

Panel reach_panel(const TaskCell& cell, std::size_t renderer, const ReachCourse& course) {
  const auto [role, shape] = group_style(cell.renderer, renderer);
  double low = 0, high = 0, last = 1;
  Panel panel;
  const auto add_points = [&](const Reaches& one, const ReachCourse& of, MarkerShape marker) {
    for (const ReachPoint& point : one.*of.points) {
      const double value = of.factor * point.value;
      low = std::min(low, value);
      high = std::max(high, value);
      last = std::max(last, point.trial + 1);
      Mark dot = symbol(Role::soft, marker, point.trial + 1, value, 1.8);
      dot.opacity = 0.6;
      dot.participant = printable(cell.participants[one.participant], 40);
      dot.text =
          dot.participant + ", trial " + short_number(point.trial + 1) + ": " + short_number(value);
      panel.marks.push_back(std::move(dot));
    }
  };
  const bool deviations = course.points == kDeviation.points;
  for (const Reaches& one : cell.reaches) {
    add_points(one, course, shape);
    if (deviations) add_points(one, kCatches, MarkerShape::saltire);
  }
  constexpr double kRuns = 20;  // of trials, whose means are drawn
  add_means(panel, cell, course, std::max(1.0, std::ceil(last / kRuns)), role, shape);
  const double margin = 0.05 * std::max(high - low, 1e-3);
  panel.title = printable(cell.renderer, 40);
  panel.x = linear_axis(0, last + 1, "trial of the block");
  panel.y = linear_axis(low - margin, high + margin, course.title);
  panel.width = 360;
  panel.height = 260;
  return panel;
}

/// The first movements and the last, from above, or from the front where they rise more than they
/// go away.
std::optional<Panel> path_panel(const TaskCell& cell, std::size_t renderer) {
  Vec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (const Reaches& one : cell.reaches) {
    for (const auto* paths : {&one.first_paths, &one.last_paths}) {
      for (const std::vector<Vec3>& path : *paths) {
        for (const Vec3& place : path) {
          low = glm::min(low, place);
          high = glm::max(high, place);
        }
      }
    }
  }
  if (!(low.x <= high.x)) return std::nullopt;
  const int up = high.z - low.z > high.y - low.y ? 2 : 1;
  Panel panel;
  const auto add = [&](const Reaches& one, const std::vector<Vec3>& path, Role role,
                       const char* when) {
    Mark line = line_mark(role, {}, {}, 1.4);
    line.opacity = 0.7;
    line.participant = printable(cell.participants[one.participant], 40);
    line.text = line.participant + ", " + when;
    for (const Vec3& place : path) {
      line.x.push_back(1e3 * place.x);
      line.y.push_back(1e3 * place[up]);
    }
    panel.marks.push_back(std::move(line));
  };
  const auto [role, shape] = group_style(cell.renderer, renderer);
  for (const Reaches& one : cell.reaches) {
    for (const auto& path : one.first_paths) add(one, path, Role::amber, "one of the first");
    for (const auto& path : one.last_paths) add(one, path, role, "one of the last");
  }
  // One scale for both axes.
  const double wide = 1e3 * (high.x - low.x), tall = 1e3 * (high[up] - low[up]);
  const double half = 0.55 * std::max({wide, tall, 1.0});
  const double x = 500 * (low.x + high.x), y = 500 * (low[up] + high[up]);
  panel.title = printable(cell.renderer, 40);
  panel.x = linear_axis(x - half, x + half, "to the right (mm)");
  panel.y = linear_axis(y - half, y + half, up == 1 ? "away (mm)" : "up (mm)");
  panel.width = panel.height = 260;
  return panel;
}

void add_reach_figures(const StudyAnalysis& analysis, std::vector<Figure>& figures) {
  const auto has = [](const TaskCell& cell) { return !cell.reaches.empty(); };
  std::size_t number = 0;
  for (const CellList& cells : grouped_cells<std::pair<std::string, std::string>>(
           analysis, has,
           [](const TaskCell& cell) { return std::pair(cell.block_name, cell.shape); })) {
    const TaskCell& first = *cells.front();
    Figure figure = new_task_figure(analysis, "reach" + std::to_string(++number),
                                    "Movements over the trials", first, first.shape);
    for (std::size_t r = 0; r < cells.size(); ++r) {
      figure.panels.push_back(reach_panel(*cells[r], r, kDeviation));
      const bool clamped = std::ranges::any_of(
          cells[r]->reaches, [](const Reaches& one) { return !one.adaptations.empty(); });
      if (clamped) figure.panels.push_back(reach_panel(*cells[r], r, kAdaptation));
      if (auto paths = path_panel(*cells[r], r)) figure.panels.push_back(std::move(*paths));
      for (const Reaches& one : cells[r]->reaches) {
        figure.description += printable(cells[r]->participants[one.participant]) + ": deviation " +
                              (one.deviation ? short_number(1e3 * *one.deviation) : "unknown") +
                              " mm";
        if (one.adaptation) figure.description += ", adaptation " + short_number(*one.adaptation);
        figure.description += ". ";
      }
    }
    figure.notes.push_back(
        "Small: single trials of all participants; crosses: catch trials, without the field. Bold: "
        "means of all participants over runs of trials. Adaptation: of clamp trials; 1 is the push "
        "that the field would have needed. Paths: each participant's first (amber) and last "
        "movements with the field, from databases only.");
    figures.push_back(std::move(figure));
  }
}

Figure figure_of(const StudyAnalysis& analysis, const TaskCell& cell, std::string id,
                 const std::string& what) {
  Figure figure = new_task_figure(analysis, std::move(id), what, cell, cell.shape);
  if (!cell.renderer.empty()) figure.title += ", " + printable(cell.renderer);
  figure.subtitle += ", " + counted(cell.trials, "trial", "trials");
  if (cell.functions.size() > kDrawnParticipants)
    figure.notes.push_back("The first " + std::to_string(kDrawnParticipants) + " of " +
                           std::to_string(cell.functions.size()) + " participants.");
  return figure;
}

}  // namespace

std::vector<Figure> task_figures(const StudyAnalysis& analysis) {
  std::vector<Figure> figures;
  add_design_figures(analysis, figures);
  add_rating_figures(analysis, figures);
  add_magnitude_figures(analysis, figures);
  add_reach_figures(analysis, figures);
  for (Figure& figure : field_figures(analysis)) figures.push_back(std::move(figure));
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
