#include "analysis/statistics/task_tracks.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <utility>
#include <variant>

namespace palpate::analysis {
namespace {

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

const protocols::BlockProcedures* block_of(const TaskTrial& trial, const TaskTable& table) {
  const auto protocol = table.procedures.find(trial.protocol_sha256);
  if (protocol == table.procedures.end()) return nullptr;
  const auto block = protocol->second.find(trial.block_name);
  return block == protocol->second.end() ? nullptr : &block->second;
}

/// False where the protocol says that a track is something else.
bool may_be_staircase(const Track& track, const TaskTrial& trial, const TaskTable& table) {
  const protocols::BlockProcedures* const block = block_of(trial, table);
  if (block == nullptr || block->specs.empty()) return true;
  int number = 0;
  std::from_chars(track.name.data(), track.name.data() + track.name.size(), number);
  return number < 1 || std::holds_alternative<protocols::Staircase>(block->spec_of(number));
}

std::optional<TrackProcedure> procedure_of(const Track& track, const TaskTrial& trial,
                                           const TaskTable& table) {
  const protocols::BlockProcedures* const block = block_of(trial, table);
  if (block == nullptr || block->specs.empty()) return std::nullopt;
  int number = 0;
  std::from_chars(track.name.data(), track.name.data() + track.name.size(), number);
  if (number < 1) return std::nullopt;
  TrackProcedure result;
  result.spec = block->spec_of(number);
  if (std::holds_alternative<protocols::ConstantStimuli>(result.spec)) return std::nullopt;
  protocols::Procedure procedure = block->begin(trial.participant_number, number);
  for (std::size_t i = 0; i < track.levels.size(); ++i)
    procedure.record({track.levels[i], track.successes[i]});
  result.estimate = procedure.estimate();
  if (const auto* staircase = std::get_if<protocols::Staircase>(&result.spec))
    result.target = protocols::convergence_point(*staircase);
  return result;
}

}  // namespace

const char* kind_of(const protocols::ProcedureSpec& spec) {
  if (std::holds_alternative<protocols::Staircase>(spec)) return "staircase";
  if (std::holds_alternative<protocols::QuestPlus>(spec)) return "quest_plus";
  return std::holds_alternative<protocols::Limits>(spec) ? "limits" : "constant";
}

std::optional<protocols::LevelScale> scale_of_adaptive(const protocols::ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<protocols::Staircase>(&spec)) return staircase->scale;
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&spec)) return quest->function.scale;
  if (const auto* limits = std::get_if<protocols::Limits>(&spec)) return limits->scale;
  return std::nullopt;
}

const std::vector<protocols::ProcedureSpec>& specs_of(const TaskTrial& trial,
                                                      const TaskTable& table) {
  static const std::vector<protocols::ProcedureSpec> kNone;
  const protocols::BlockProcedures* const block = block_of(trial, table);
  return block == nullptr ? kNone : block->specs;
}

std::vector<Track> tracks_of(const std::vector<const TaskTrial*>& trials, const TaskTable& table) {
  std::map<std::string, std::vector<const TaskTrial*>> named;
  for (const TaskTrial* trial : trials) {
    if (trial->level && !trial->catch_trial && trial->answered)
      named[trial->track].push_back(trial);
  }
  std::vector<Track> tracks;
  for (const auto& [name, own] : named) {
    if (own.size() < 2) continue;
    Track track;
    track.name = name;
    for (const TaskTrial* trial : own) {
      track.levels.push_back(*trial->level);
      track.successes.push_back(trial->success);
    }
    if (may_be_staircase(track, *own.front(), table)) track.reversals = reversals_of(track);
    track.procedure = procedure_of(track, *own.front(), table);
    tracks.push_back(std::move(track));
  }
  std::sort(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return std::pair(a.name.size(), a.name) < std::pair(b.name.size(), b.name);  // as numbers
  });
  return tracks;
}

void add_fitted_levels(std::vector<Track>& tracks, const PsychometricModel& model,
                       const PsychometricFit& fit) {
  const auto& [threshold, slope, guess, lapse] = fit.parameters;
  for (Track& track : tracks) {
    if (!track.procedure || !track.procedure->target) continue;
    const double share = (*track.procedure->target - guess) / (1 - guess - lapse);
    if (share > 0 && share < 1)
      track.procedure->fitted_level = psychometric_level(model.function, fit.parameters, share);
  }
}

}  // namespace palpate::analysis
