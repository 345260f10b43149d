#include "analysis/statistics/task_group.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "analysis/statistics/group_detection.h"
#include "analysis/statistics/group_psychometric.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"
#include "data/base/words.h"

namespace palpate::analysis {
namespace {

std::string open_status(const std::string& undefined, bool low, bool high) {
  if (!undefined.empty()) return "undefined";
  if (!low && !high) return "not determined";
  return !low ? "low open" : !high ? "high open" : "ok";
}

using Cells = std::vector<const TaskCell*>;

/// A block and stimulus with all its renderers, ready for the model.
struct GroupTask {
  Cells cells;
  std::vector<std::string> participants;
  GroupPsychometricModel model;
  GroupPsychometricData data;
  std::vector<std::vector<GroupAnswers>> answers;    ///< [renderer][participant]
  std::vector<std::size_t> reversed;                 ///< of each renderer
  std::vector<std::vector<std::string>> no_answers;  ///< of each renderer
};

bool has_functions(const TaskCell& cell) {
  return !cell.functions.empty() && cell.no_function.empty();
}

GroupPsychometricModel model_of(const TaskCell& cell) {
  const PsychometricModel& own = cell.functions.front().model;
  GroupPsychometricModel model;
  model.function = own.function;
  // The direction of most: single functions may be reversed.
  const auto falling = std::ranges::count_if(cell.functions, [](const ParticipantFunction& one) {
    return (one.model.function.easier == protocols::Easier::lower) != one.reversed;
  });
  model.function.easier = 2 * static_cast<std::size_t>(falling) > cell.functions.size()
                              ? protocols::Easier::lower
                              : protocols::Easier::higher;
  if (own.guess_is_lapse) return model;
  model.asymptotes = own.guess.free ? GroupAsymptotes::own_guess : GroupAsymptotes::fixed_guess;
  model.guess = own.guess.value;
  // The log of the distance from 0 is the log of the level.
  const bool from_zero =
      cell.standard_level == 0.0 && model.function.scale != protocols::LevelScale::linear;
  if (cell.forced_choice && !from_zero) model.standard = cell.standard_level;
  return model;
}

/// A measure of the model: which coordinate, and how it is shown.
struct GroupMeasure {
  const char* name;
  GroupCoordinate coordinate;
  bool ratio;         ///< comparisons are ratios
  double factor = 1;  ///< of the shown value
  bool with_unit = true;
};

/// Value of a coordinate in the unit of a measure.
double shown(const GroupTask& task, const GroupMeasure& measure, double value) {
  if (measure.coordinate == GroupCoordinate::first)
    return measure.factor * group_level(task.model, value);
  const bool log_scale = task.model.function.scale != protocols::LevelScale::linear;
  return measure.factor * (log_scale ? std::expm1(std::exp(value)) : std::exp(value));
}

void add_answers(GroupTask& task, const TaskCell& cell) {
  std::vector<GroupAnswers> answers(task.participants.size());
  std::size_t reversed = 0;
  for (const ParticipantFunction& one : cell.functions) {
    if (one.reversed) {
      ++reversed;
      continue;
    }
    const auto at = std::ranges::find(task.participants, one.participant);
    GroupAnswers& own = answers[static_cast<std::size_t>(at - task.participants.begin())];
    own.counts = one.counts;
    own.catch_trials = one.catches.noise_trials;
    own.catch_successes = one.catches.false_alarms;
  }
  std::vector<std::string> none;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const bool shown = std::ranges::any_of(cell.functions, [&](const ParticipantFunction& one) {
      return one.participant == task.participants[i];
    });
    if (!shown) none.push_back(task.participants[i]);
  }
  task.answers.push_back(std::move(answers));
  task.reversed.push_back(reversed);
  task.no_answers.push_back(std::move(none));
}

const TaskGroupModel* model_of(const std::vector<TaskGroupModel>& models, const TaskGroup& group,
                               const std::string& renderer) {
  const auto found = std::ranges::find_if(models, [&](const TaskGroupModel& one) {
    return one.task == group.task && one.block_name == group.block_name &&
           one.shape == group.shape && one.measure == group.measure && one.renderer == renderer;
  });
  return found == models.end() ? nullptr : &*found;
}

GroupTask task_of(const Cells& cells) {
  GroupTask task;
  task.cells = cells;
  std::set<std::string> names;
  for (const TaskCell* cell : cells) {
    for (const ParticipantFunction& one : cell->functions) names.insert(one.participant);
  }
  task.participants.assign(names.begin(), names.end());
  task.model = model_of(*cells.front());
  for (const TaskCell* cell : cells) add_answers(task, *cell);
  task.data = group_psychometric_data(task.answers, task.model);
  return task;
}

std::vector<GroupMeasure> measures_of(const GroupTask& task) {
  const TaskCell& cell = *task.cells.front();
  const bool log_scale = task.model.function.scale != protocols::LevelScale::linear;
  const std::optional<double> standard = cell.standard_level;
  std::vector<GroupMeasure> out;
  if (task.model.standard) {
    out.push_back({"jnd", GroupCoordinate::first, true});
    if (*standard > 0)
      out.push_back({"weber_fraction", GroupCoordinate::first, true, 1 / *standard, false});
    return out;
  }
  if (task.model.asymptotes != GroupAsymptotes::both_lapse) {
    const bool from_zero = cell.forced_choice && standard.has_value();
    out.push_back({from_zero ? "jnd" : "threshold", GroupCoordinate::first, log_scale});
    return out;
  }
  out.push_back({"pse", GroupCoordinate::first, log_scale});
  const bool has_standard = standard && *standard > 0;
  // On a logarithmic scale the width is a ratio: its JND is that at the standard.
  if (!log_scale || has_standard)
    out.push_back({"jnd", GroupCoordinate::second, true, log_scale ? *standard : 1});
  if (log_scale || has_standard)
    out.push_back(
        {"weber_fraction", GroupCoordinate::second, true, log_scale ? 1 : 1 / *standard, false});
  return out;
}

std::string capital(const std::string& measure) {
  if (measure == "jnd") return "JND";
  if (measure == "pse") return "PSE";
  return measure == "weber_fraction" ? "Weber fraction" : "threshold";
}

void put_notes(const GroupTask& task, std::size_t c, GroupCoordinate coordinate,
               const GroupMoments& moments, TaskGroupModel& row) {
  const auto note = [&](const std::string& text) { row.notes.push_back(text); };
  if (row.n < 3) {
    note("fewer than three participants: no interval");
  } else if (!row.low && !row.high) {
    note(capital(row.measure) + " not determined");
  } else if (!row.low) {
    note(capital(row.measure) + " below " + short_number(*row.high));
  } else if (!row.high) {
    note(capital(row.measure) + " above " + short_number(*row.low));
  }
  if (row.n == 3 || row.n == 4) note("intervals of three or four participants were not simulated");
  if (row.lapse_mean && *row.lapse_mean >= 0.1) note("many lapses");
  const GroupData& data = task.data.data;
  const double floor =
      coordinate == GroupCoordinate::first ? data.first.least_sd : data.second.least_sd;
  if (moments.sd < 1.0001 * floor) note("no difference between participants found");
  if (row.measure == "jnd" && !task.model.standard &&
      std::exp(moments.mean) < task.data.least_spacing / 2)
    note("levels too coarse for the JND: it may be too large");
  if (!task.no_answers[c].empty()) note("no trials: " + printable(listed(task.no_answers[c])));
  if (task.reversed[c] > 0)
    note(counted(task.reversed[c], "participant", "participants") +
         " with reversed answers left out");
}

TaskGroupModel row_of(const GroupTask& task, const GroupFit* fit, std::size_t c,
                      const GroupMeasure& measure) {
  const TaskCell& cell = *task.cells[c];
  TaskGroupModel row;
  row.block_name = cell.block_name;
  row.task = cell.task;
  row.shape = cell.shape;
  row.measure = measure.name;
  row.renderer = cell.renderer;
  if (measure.with_unit) row.unit = cell.level_unit;
  row.geometric = measure.ratio;
  row.undefined = task.data.undefined;
  if (fit == nullptr) return row;
  const GroupCondition& own = fit->conditions[c];
  row.n = own.participants;
  if (row.n == 0) {
    row.undefined = "no trials";
    return row;
  }
  const GroupMoments& moments =
      measure.coordinate == GroupCoordinate::first ? own.first : own.second;
  const bool falls = measure.coordinate == GroupCoordinate::first && !task.model.standard &&
                     task.model.function.easier == protocols::Easier::lower;
  row.estimate = shown(task, measure, moments.mean);
  row.sd_between = moments.sd;
  row.lapse_mean = task.data.lapse_means[fit->setting];
  std::optional<double> low, high;
  if (!moments.low_open) low = shown(task, measure, moments.ci95.low);
  if (!moments.high_open) high = shown(task, measure, moments.ci95.high);
  row.low = falls ? high : low;
  row.high = falls ? low : high;
  put_notes(task, c, measure.coordinate, moments, row);
  return row;
}

IndividualFits individual_of(const TaskGroupComparison& one,
                             const std::vector<TaskComparison>& individual) {
  IndividualFits out;
  for (const TaskComparison& other : individual) {
    if (other.block_name != one.block_name || other.task != one.task || other.shape != one.shape ||
        other.measure != one.measure || other.conditions[0] != one.reference)
      continue;
    out.left_out = other.n_undetermined;
    for (const ConditionDifference& difference : other.comparison.differences) {
      if (other.conditions[difference.condition] != one.compared) continue;
      out.n = difference.n_pairs;
      out.t = difference.t_test.t;
      out.df = difference.t_test.df;
      out.p = difference.t_test.p;
    }
  }
  return out;
}

TaskGroupComparison comparison_of(const GroupTask& task, const GroupFit& fit, std::size_t c,
                                  const GroupMeasure& measure, const GroupDifference& found) {
  TaskGroupComparison row;
  const TaskCell& cell = *task.cells[c];
  row.block_name = cell.block_name;
  row.task = cell.task;
  row.shape = cell.shape;
  row.measure = measure.name;
  row.reference = task.cells[0]->renderer;
  row.compared = cell.renderer;
  row.ratio = measure.ratio;
  row.n = found.pairs;
  if (fit.conditions[0].participants == 0 || fit.conditions[c].participants == 0 || row.n < 3) {
    row.undefined = "fewer than three participants with both renderers";
    return row;
  }
  const bool falls = measure.coordinate == GroupCoordinate::first && !task.model.standard &&
                     task.model.function.easier == protocols::Easier::lower;
  const auto back = [&](double value) {
    const double own = falls ? -value : value;
    return measure.ratio ? std::exp(own) : own;
  };
  row.estimate = back(found.difference);
  std::optional<double> low, high;
  if (!found.low_open) low = back(found.ci95->low);
  if (!found.high_open) high = back(found.ci95->high);
  row.low = falls ? high : low;
  row.high = falls ? low : high;
  if (found.ci90) {
    std::optional<double> low90, high90;
    if (!found.low_open) low90 = back(found.ci90->low);
    if (!found.high_open) high90 = back(found.ci90->high);
    row.low90 = falls ? high90 : low90;
    row.high90 = falls ? low90 : high90;
  }
  row.p = found.p;
  row.likelihood_ratio = found.likelihood_ratio;
  return row;
}

/// Holm's adjustment over the comparisons from `first` on.
void adjust(TaskGroupResults& out, std::size_t first) {
  std::vector<std::optional<double>> p;
  for (std::size_t i = first; i < out.comparisons.size(); ++i) p.push_back(out.comparisons[i].p);
  const auto adjusted = holm(p);
  const auto tests = static_cast<std::size_t>(
      std::ranges::count_if(p, [](const auto& one) { return one.has_value(); }));
  for (std::size_t i = 0; i < adjusted.size(); ++i) {
    out.comparisons[first + i].p_holm = adjusted[i];
    out.comparisons[first + i].n_tests = tests;
  }
}

void add_task(const GroupTask& task, const std::vector<TaskComparison>& individual,
              TaskGroupResults& out) {
  const bool defined = task.data.undefined.empty();
  std::optional<GroupFit> fit;
  if (defined) fit = fit_group(task.data.data);
  const std::vector<GroupMeasure> measures = measures_of(task);
  for (const GroupMeasure& measure : measures) {
    for (std::size_t c = 0; c < task.cells.size(); ++c)
      out.models.push_back(row_of(task, fit ? &*fit : nullptr, c, measure));
  }
  if (!fit || task.cells.size() < 2) return;
  std::map<std::pair<GroupCoordinate, std::size_t>, GroupDifference> found;
  for (const GroupMeasure& measure : measures) {
    const std::size_t first = out.comparisons.size();
    for (std::size_t c = 1; c < task.cells.size(); ++c) {
      const std::pair key{measure.coordinate, c};
      const bool both = fit->conditions[0].participants > 0 && fit->conditions[c].participants > 0;
      if (both && !found.contains(key))
        found[key] = compare_group(task.data.data, *fit, measure.coordinate, 0, c, {true, true});
      out.comparisons.push_back(comparison_of(task, *fit, c, measure, found[key]));
      TaskGroupComparison& row = out.comparisons.back();
      row.individual_fits = individual_of(row, individual);
    }
    adjust(out, first);
  }
}

// d' at each level that all judge. Levels of adaptive procedures differ between participants.

constexpr std::size_t kMostDetectionLevels = 9, kLeastDetectionTrials = 5;

/// Levels with enough trials of every participant with every renderer.
std::vector<double> shared_levels(const Cells& cells) {
  std::vector<double> shared;
  bool first = true;
  for (const TaskCell* cell : cells) {
    for (const ParticipantFunction& one : cell->functions) {
      std::vector<double> own;
      for (const LevelCount& count : one.counts) {
        if (count.trials >= static_cast<int>(kLeastDetectionTrials)) own.push_back(count.level);
      }
      std::vector<double> both;
      std::ranges::set_intersection(shared, own, std::back_inserter(both));
      shared = first ? own : both;
      first = false;
    }
  }
  if (shared.size() > kMostDetectionLevels) shared.clear();
  return shared;
}

LevelCount count_at(const ParticipantFunction& one, double level) {
  const auto found = std::ranges::find(one.counts, level, &LevelCount::level);
  return found == one.counts.end() ? LevelCount{level, 0, 0} : *found;
}

const ParticipantFunction* function_of(const TaskCell& cell, const std::string& participant) {
  const auto found =
      std::ranges::find(cell.functions, participant, &ParticipantFunction::participant);
  return found == cell.functions.end() || found->reversed ? nullptr : &*found;
}

/// Likelihoods of d' (and criterion) at a level.
GroupData detection_at(const Cells& cells, const std::vector<std::string>& participants,
                       double level) {
  std::vector<std::vector<DetectionCounts>> detections;
  std::vector<std::vector<ForcedChoiceCounts>> choices;
  for (const TaskCell* cell : cells) {
    auto& detected = detections.emplace_back();
    auto& chosen = choices.emplace_back();
    for (const std::string& name : participants) {
      const ParticipantFunction* one = function_of(*cell, name);
      const LevelCount count = one == nullptr ? LevelCount{level, 0, 0} : count_at(*one, level);
      chosen.push_back({count.trials, count.successes});
      detected.push_back({count.trials, count.successes, 0, 0});
      if (one == nullptr) continue;
      detected.back().noise_trials = one->catches.noise_trials;
      detected.back().false_alarms = one->catches.false_alarms;
    }
  }
  return cells.front()->forced_choice ? group_forced_choice_data(choices, cells.front()->intervals)
                                      : group_detection_data(detections);
}

bool has_detection(const TaskCell& cell) {
  if (cell.forced_choice) return true;
  return cell.task == "detect" && std::ranges::any_of(cell.functions, [](const auto& one) {
           return one.catches.noise_trials > 0;
         });
}

TaskGroupModel detection_row(const TaskCell& cell, const char* measure, double level,
                             const GroupMoments& found, std::size_t n) {
  TaskGroupModel row;
  row.block_name = cell.block_name;
  row.task = cell.task;
  row.shape = cell.shape;
  row.measure = measure;
  row.level = level;
  row.renderer = cell.renderer;
  row.n = n;
  row.estimate = found.mean;
  row.sd_between = found.sd;
  if (!found.low_open) row.low = found.ci95.low;
  if (!found.high_open) row.high = found.ci95.high;
  if (n < 3) row.notes.emplace_back("fewer than three participants: no interval");
  return row;
}

TaskGroupComparison detection_comparison(const Cells& cells, std::size_t c, double level,
                                         const GroupDifference& found) {
  TaskGroupComparison row;
  row.block_name = cells[c]->block_name;
  row.task = cells[c]->task;
  row.shape = cells[c]->shape;
  row.measure = "d_prime";
  row.level = level;
  row.reference = cells.front()->renderer;
  row.compared = cells[c]->renderer;
  row.n = found.pairs;
  if (!found.ci95) {
    row.undefined = "fewer than three participants with both renderers";
    return row;
  }
  row.estimate = found.difference;
  if (!found.low_open) row.low = found.ci95->low;
  if (!found.high_open) row.high = found.ci95->high;
  if (!found.low_open) row.low90 = found.ci90->low;
  if (!found.high_open) row.high90 = found.ci90->high;
  row.p = found.p;
  row.likelihood_ratio = found.likelihood_ratio;
  return row;
}

void add_detection(const Cells& cells, TaskGroupResults& out) {
  if (!std::ranges::all_of(cells, [](const TaskCell* cell) { return has_detection(*cell); }))
    return;
  std::set<std::string> names;
  for (const TaskCell* cell : cells) {
    for (const ParticipantFunction& one : cell->functions) names.insert(one.participant);
  }
  const std::vector<std::string> participants(names.begin(), names.end());
  const std::size_t first = out.comparisons.size();
  for (const double level : shared_levels(cells)) {
    const GroupData data = detection_at(cells, participants, level);
    const GroupFit fit = fit_group(data);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const GroupCondition& own = fit.conditions[c];
      if (own.participants == 0) continue;
      out.models.push_back(detection_row(*cells[c], "d_prime", level, own.first, own.participants));
      if (data.second.points > 1)
        out.models.push_back(
            detection_row(*cells[c], "criterion", level, own.second, own.participants));
    }
    for (std::size_t c = 1; c < cells.size(); ++c) {
      if (fit.conditions[0].participants == 0 || fit.conditions[c].participants == 0) continue;
      out.comparisons.push_back(detection_comparison(
          cells, c, level, compare_group(data, fit, GroupCoordinate::first, 0, c, {true, true})));
    }
  }
  adjust(out, first);
}

bool of_same_stimulus(const auto& a, const auto& b) {
  return a.task == b.task && a.block_name == b.block_name && a.shape == b.shape;
}

/// Participants with a figure of a renderer.
std::set<std::string> names_with(const TaskGroup& group, const std::string& renderer) {
  std::set<std::string> names;
  for (const GroupMean& one : group.renderers) {
    if (one.renderer != renderer) continue;
    for (const NamedFigure& figure : one.participants) names.insert(figure.participant);
  }
  return names;
}

}  // namespace

std::string TaskGroupModel::status() const {
  return open_status(undefined, low.has_value(), high.has_value());
}

std::string TaskGroupComparison::status() const {
  return open_status(undefined, low.has_value(), high.has_value());
}

TaskGroupResults group_models(const std::vector<TaskCell>& cells,
                              const std::vector<TaskComparison>& individual) {
  using Key = std::tuple<std::string, std::string, std::string>;
  std::vector<Cells> groups;
  std::map<Key, std::size_t> places;
  for (const TaskCell& cell : cells) {
    if (!has_functions(cell)) continue;
    const auto [place, is_new] =
        places.emplace(Key{cell.task, cell.block_name, cell.shape}, groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&cell);
  }
  TaskGroupResults out;
  for (Cells& group : groups) {
    std::ranges::stable_sort(group, {}, [](const TaskCell* cell) {
      return cell->renderer == "point" ? 0 : cell->renderer == "ray" ? 1 : 2;
    });
    add_task(task_of(group), individual, out);
    add_detection(group, out);
  }
  return out;
}

void name_left_out(const std::vector<TaskCell>& cells, const std::vector<TaskGroup>& groups,
                   TaskGroupResults& results) {
  for (TaskGroupComparison& one : results.comparisons) {
    const auto group = std::ranges::find_if(groups, [&](const TaskGroup& other) {
      return of_same_stimulus(other, one) && other.measure == one.measure;
    });
    if (group == groups.end()) continue;
    const std::set<std::string> first = names_with(*group, one.reference),
                                second = names_with(*group, one.compared);
    std::set<std::string> shown;
    for (const TaskCell& cell : cells) {
      if (!of_same_stimulus(cell, one)) continue;
      if (cell.renderer != one.reference && cell.renderer != one.compared) continue;
      for (const ParticipantFunction& function : cell.functions) shown.insert(function.participant);
    }
    for (const std::string& name : shown) {
      if (!first.contains(name) || !second.contains(name))
        one.individual_fits.left_out_names.push_back(name);
    }
  }
}

void put_model_values(const std::vector<TaskGroupModel>& models, std::vector<TaskGroup>& groups) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (TaskGroup& group : groups) {
    for (GroupMean& one : group.renderers) {
      const TaskGroupModel* model = model_of(models, group, one.renderer);
      if (model == nullptr) continue;
      group.geometric = model->geometric;
      one.of_model = true;
      one.n_of_model = model->n;
      one.mean = model->estimate;
      one.sd = model->sd_between;
      one.ci95.reset();
      if (model->low || model->high)
        one.ci95 = Interval{model->low.value_or(-kInfinity), model->high.value_or(kInfinity)};
      one.notes = model->notes;
      if (!model->undefined.empty()) one.notes.insert(one.notes.begin(), model->undefined);
    }
  }
}

}  // namespace palpate::analysis
