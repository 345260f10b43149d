#include "analysis/figures/task_figures.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "analysis/figures/axes.h"
#include "analysis/figures/marks.h"
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

Panel function_panel(const ParticipantFunction& one) {
  Panel panel;
  panel.title = stimuli::printable(one.participant);
  const Interval range = levels_of(one);
  panel.x = linear_axis(range.low, range.high, "level");
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

/// Levels in the order of a track: a circle where the answer was a success, a diamond where it
/// turned.
Panel track_panel(const ParticipantFunction& one, const Track& track) {
  Panel panel;
  panel.title = stimuli::printable(one.participant);
  if (one.tracks.size() > 1) panel.title += ", track " + stimuli::printable(track.name);
  const auto [low, high] = std::minmax_element(track.levels.begin(), track.levels.end());
  const double margin = *low < *high ? 0.06 * (*high - *low) : 0.5;
  panel.x = linear_axis(0, static_cast<double>(track.levels.size() + 1), "trial of the track");
  panel.y = linear_axis(*low - margin, *high + margin, "level");
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

Figure figure_of(const TaskAnalysis& analysis, const TaskCell& cell, std::string id,
                 const std::string& what) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = what + ": " + cell.task;
  for (const std::string* name : {&cell.block_name, &cell.shape, &cell.renderer}) {
    if (!name->empty()) figure.title += ", " + stimuli::printable(*name);
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
  std::size_t number = 0;
  for (const TaskCell& cell : analysis.cells) {
    if (cell.functions.empty()) continue;
    const std::string suffix = std::to_string(++number);
    Figure functions = figure_of(analysis, cell, "function" + suffix, "Psychometric functions");
    Figure tracks = figure_of(analysis, cell, "track" + suffix, "Levels over the trials");
    functions.notes.insert(functions.notes.begin(),
                           "Circles: share of successes, larger where there are more trials. Line: "
                           "fitted function, with the 95 % interval of its threshold.");
    tracks.notes.insert(tracks.notes.begin(),
                        "Circles: successes (the comparison chosen, yes, different). Crosses: no "
                        "success. Diamonds: reversals of a staircase.");
    for (std::size_t i = 0; i < std::min(cell.functions.size(), kDrawnParticipants); ++i) {
      const ParticipantFunction& one = cell.functions[i];
      if (!one.counts.empty()) functions.panels.push_back(function_panel(one));
      for (std::size_t t = 0; t < std::min(one.tracks.size(), kDrawnTracks); ++t)
        tracks.panels.push_back(track_panel(one, one.tracks[t]));
      functions.description +=
          stimuli::printable(one.participant) + ": " +
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
