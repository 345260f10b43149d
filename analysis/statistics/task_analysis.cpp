#include "analysis/statistics/task_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace palpate::analysis {
namespace {

using Trials = std::vector<const TaskTrial*>;
using CellKey = std::tuple<std::string, std::string, std::string, std::string>;

/// Groups in the order of their first trial.
template <class Key, class KeyOf>
std::vector<std::pair<Key, Trials>> grouped(const Trials& trials, KeyOf key_of) {
  std::vector<std::pair<Key, Trials>> groups;
  std::map<Key, std::size_t> places;
  for (const TaskTrial* trial : trials) {
    const auto [place, is_new] = places.emplace(key_of(*trial), groups.size());
    if (is_new) groups.push_back({place->first, {}});
    groups[place->second].second.push_back(trial);
  }
  return groups;
}

std::vector<std::pair<std::string, Trials>> by_participant(const Trials& trials) {
  return grouped<std::string>(trials, [](const TaskTrial& trial) { return trial.participant; });
}

std::vector<LevelCount> counts_of_levels(const Trials& trials) {
  std::vector<LevelCount> counts;
  for (const TaskTrial* trial : trials) {
    if (trial->answered && trial->level && !trial->catch_trial)
      counts.push_back({*trial->level, 1, trial->success ? 1 : 0});
  }
  return sum_by_level(std::move(counts));
}

/// Which levels have more successes: the sign of their covariance.
protocols::Easier easier_of(const std::vector<LevelCount>& counts) {
  double n = 0, x = 0, y = 0, xy = 0;
  for (const LevelCount& count : counts) {
    n += count.trials;
    x += count.trials * count.level;
    y += count.successes;
    xy += count.successes * count.level;
  }
  return n > 0 && xy / n < x / n * y / n ? protocols::Easier::lower : protocols::Easier::higher;
}

/// False alarms: successes in catch trials.
DetectionCounts detections_of(const Trials& trials) {
  DetectionCounts counts;
  for (const TaskTrial* trial : trials) {
    if (!trial->answered) continue;
    (trial->catch_trial ? counts.noise_trials : counts.signal_trials) += 1;
    if (trial->success) (trial->catch_trial ? counts.false_alarms : counts.hits) += 1;
  }
  return counts;
}

/// A staircase goes one way after a success, if at all, and the other way after a failure: whatever
/// does not is none.
std::vector<std::size_t> reversals_of(const Track& track) {
  std::vector<std::size_t> turns;
  int after_success = 0, last = 0;
  for (std::size_t i = 1; i < track.levels.size(); ++i) {
    const double change = track.levels[i] - track.levels[i - 1];
    if (change == 0) continue;
    const int way = change > 0 ? 1 : -1;
    const int meaning = track.successes[i - 1] ? way : -way;
    if (after_success == 0) after_success = meaning;
    if (meaning != after_success) return {};
    if (last != 0 && way != last) turns.push_back(i - 1);
    last = way;
  }
  return turns;
}

std::vector<Track> tracks_of(const Trials& trials) {
  std::vector<Track> tracks;
  for (const auto& [name, own] :
       grouped<std::string>(trials, [](const TaskTrial& trial) { return trial.track; })) {
    Track track;
    track.name = name;
    for (const TaskTrial* trial : own) {
      if (!trial->level || trial->catch_trial || !trial->answered) continue;
      track.levels.push_back(*trial->level);
      track.successes.push_back(trial->success);
    }
    if (track.levels.size() < 2) continue;
    track.reversals = reversals_of(track);
    tracks.push_back(std::move(track));
  }
  std::sort(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return std::pair(a.name.size(), a.name) < std::pair(b.name.size(), b.name);  // as numbers
  });
  return tracks;
}

/// Catch trials tell the guess rate: they stand infinitely far on the hard side.
std::vector<LevelCount> with_catch_trials(std::vector<LevelCount> counts,
                                          const DetectionCounts& detections,
                                          protocols::Easier easier) {
  if (detections.noise_trials == 0) return counts;
  const double infinity = std::numeric_limits<double>::infinity();
  counts.push_back({easier == protocols::Easier::higher ? -infinity : infinity,
                    detections.noise_trials, detections.false_alarms});
  return counts;
}

ParticipantFunction function_of(const std::string& participant, const Trials& trials,
                                const TaskCell& cell, int simulations, std::uint64_t seed) {
  ParticipantFunction result;
  result.participant = participant;
  result.counts = counts_of_levels(trials);
  result.model.function.easier = easier_of(result.counts);
  if (cell.forced_choice) result.model.guess.value = 0.5;
  const DetectionCounts detections = detections_of(trials);
  std::vector<LevelCount> counts = result.counts;
  if (cell.task == "detect") {
    result.model.guess = {0, true, 0.5};
    counts = with_catch_trials(counts, detections, result.model.function.easier);
  }
  result.model.lapse = {0, true, 0.06};
  result.fit = fit_psychometric(counts, result.model);
  if (result.fit.undefined.empty()) {
    result.goodness = goodness_of_fit(counts, result.model, result.fit, simulations, seed);
    result.discrimination = discrimination(result.fit, result.model.function, cell.standard_level);
  }
  result.posterior = psychometric_posterior(counts, result.model);
  result.tracks = tracks_of(trials);
  result.detectability =
      cell.task == "detect" ? detectability(detections, DetectionTask::yes_no) : Detectability{};
  if (cell.task != "detect") result.detectability.undefined = "no yes/no task";
  return result;
}

void add_functions(TaskCell& cell, const Trials& trials, int simulations, std::uint64_t seed) {
  bool above = false, below = false;
  for (const TaskTrial* trial : trials) {
    if (trial->standard_level) cell.standard_level = trial->standard_level;
    if (!trial->level || !trial->standard_level || trial->catch_trial) continue;
    above |= *trial->level > *trial->standard_level;
    below |= *trial->level < *trial->standard_level;
  }
  const bool same_different = std::any_of(trials.begin(), trials.end(), [](const auto* trial) {
    return trial->response == "same" || trial->response == "different";
  });
  cell.forced_choice = cell.task == "compare" && above != below && !same_different;
  for (const auto& [participant, own] : by_participant(trials))
    cell.functions.push_back(function_of(participant, own, cell, simulations, seed));
}

void add_magnitude(TaskCell& cell, const Trials& trials) {
  std::vector<MagnitudeTrial> judged;
  std::size_t number = 0;
  for (const auto& [participant, own] : by_participant(trials)) {
    for (const TaskTrial* trial : own) {
      if (trial->answered && trial->level && trial->number)
        judged.push_back({number, *trial->level, *trial->number});
    }
    ++number;
  }
  cell.magnitude = magnitude_estimation(judged, false);
}

void add_adjustments(TaskCell& cell, const Trials& trials) {
  std::vector<AdjustmentTrial> settings;
  std::size_t number = 0;
  for (const auto& [participant, own] : by_participant(trials)) {
    for (const TaskTrial* trial : own) {
      if (trial->answered && trial->level && trial->number && trial->standard_level)
        settings.push_back({number, *trial->standard_level, *trial->number,
                            *trial->level > *trial->standard_level});
    }
    ++number;
  }
  cell.adjustments = adjustments(settings);
}

InformationTransfer transfer_of(const Trials& trials) {
  std::map<std::string, std::size_t> stimuli, answers;
  for (const TaskTrial* trial : trials) {
    if (!trial->answered) continue;
    stimuli.emplace(trial->shape, stimuli.size());
    answers.emplace(trial->response, answers.size());
  }
  std::vector<std::vector<std::size_t>> counts(stimuli.size(),
                                               std::vector<std::size_t>(answers.size(), 0));
  for (const TaskTrial* trial : trials) {
    if (trial->answered) ++counts[stimuli[trial->shape]][answers[trial->response]];
  }
  return information_transfer(counts);
}

Type2Roc confidence_of(const Trials& trials) {
  std::vector<ConfidenceTrial> sure;
  for (const TaskTrial* trial : trials) {
    if (trial->answered && trial->confidence) sure.push_back({trial->correct, *trial->confidence});
  }
  Type2Roc roc = type2_roc(sure);
  if (sure.empty()) roc.undefined = "nobody was asked";
  return roc;
}

TaskCell cell_of(const CellKey& key, const Trials& trials, int simulations, std::uint64_t seed) {
  TaskCell cell;
  std::tie(cell.task, cell.block_name, cell.shape, cell.renderer) = key;
  cell.trials = trials.size();
  for (const TaskTrial* trial : trials) {
    cell.answered += trial->answered ? 1 : 0;
    cell.correct += trial->correct ? 1 : 0;
  }
  for (const auto& [participant, own] : by_participant(trials))
    cell.participants.push_back(participant);
  if (cell.task == "compare" || cell.task == "detect")
    add_functions(cell, trials, simulations, seed);
  if (cell.task == "rate") add_magnitude(cell, trials);
  if (cell.task == "adjust") add_adjustments(cell, trials);
  if (cell.task == "identify") cell.information = transfer_of(trials);
  cell.confidence = confidence_of(trials);
  return cell;
}

}  // namespace

TaskAnalysis analyze_tasks(TaskTable table, int simulations, std::uint64_t seed,
                           const AnalysisSettings& settings, const std::string& program_version) {
  TaskAnalysis result;
  result.table = std::move(table);
  Trials all;
  for (const TaskTrial& trial : result.table.trials) all.push_back(&trial);
  const auto key_of = [](const TaskTrial& trial) {
    // Identification is of all stimuli of a block together.
    return CellKey{trial.task, trial.block_name, trial.task == "identify" ? "" : trial.shape,
                   trial.renderer};
  };
  for (const auto& [key, trials] : grouped<CellKey>(all, key_of))
    result.cells.push_back(cell_of(key, trials, simulations, seed));
  result.renderers = compare_renderers(result.cells);
  result.conditions = compare_conditions(result.cells);
  if (auto shapes = identification_of(result.table)) {
    result.accuracy = accuracy_model(*shapes);
    result.identification = analyze(std::move(*shapes), settings, program_version);
  }
  return result;
}

}  // namespace palpate::analysis
