#include "analysis/statistics/task_tracks.h"

#include <algorithm>
#include <array>
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
  int after_success = 0, last = 0, alike = 0;
  // So many answers alike move it, failures and successes: the fewest that did. 0: none did yet.
  std::array<int, 2> moves_after{0, 0};
  for (std::size_t i = 1; i < track.levels.size(); ++i) {
    const bool success = track.successes[i - 1];
    const bool goes_on = i > 1 && alike > 0 && track.successes[i - 2] == success;
    alike = goes_on ? alike + 1 : 1;
    const double change = track.levels[i] - track.levels[i - 1];
    if (change == 0) continue;
    const int way = change > 0 ? 1 : -1;
    const int meaning = success ? way : -way;
    if (after_success == 0) after_success = meaning;
    if (meaning != after_success) return {};
    if (last != 0 && way != last) turns.push_back(i - 1);
    last = way;
    int& fewest = moves_after[success ? 1 : 0];
    if (fewest == 0 || alike < fewest) fewest = alike;
    alike = 0;
  }
  if (last == 0) return turns;
  // No level shows what the last answer did.
  const std::size_t end = track.levels.size() - 1;
  const bool success = track.successes[end];
  alike = alike > 0 && track.successes[end - 1] == success ? alike + 1 : 1;
  const int way = success ? after_success : -after_success;
  if (alike == moves_after[success ? 1 : 0] && way != last) turns.push_back(end);
  return turns;
}

/// The spec of a track; nullptr: its protocol, or its number, is not in the source.
const protocols::ProcedureSpec* spec_of(const Track& track, const TaskTrial& trial,
                                        const TaskTable& table, int& number) {
  const protocols::BlockProcedures* const block = block_of(trial, table);
  if (block == nullptr || block->specs.empty()) return nullptr;
  number = 0;
  std::from_chars(track.name.data(), track.name.data() + track.name.size(), number);
  return number < 1 ? nullptr : &block->spec_of(number);
}

/// Sets procedure and reversals of a track whose spec is known.
void replay(Track& track, const TaskTrial& trial, const TaskTable& table,
            const protocols::ProcedureSpec& spec, int number) {
  if (std::holds_alternative<protocols::ConstantStimuli>(spec)) return;
  const auto* const staircase = std::get_if<protocols::Staircase>(&spec);
  TrackProcedure result;
  result.spec = spec;
  protocols::Procedure procedure = block_of(trial, table)->begin(trial.participant_number, number);
  int reversals = 0;
  for (std::size_t i = 0; i < track.levels.size(); ++i) {
    procedure.record({track.levels[i], track.successes[i]});
    if (staircase == nullptr) continue;
    const int so_far = procedure.estimate().reversals;
    if (so_far > reversals) track.reversals.push_back(i);
    reversals = so_far;
  }
  result.estimate = procedure.estimate();
  if (staircase != nullptr) result.target = protocols::convergence_point(*staircase);
  track.procedure = std::move(result);
}

}  // namespace

const protocols::BlockProcedures* block_of(const TaskTrial& trial, const TaskTable& table) {
  const auto protocol = table.procedures.find(trial.protocol_sha256);
  if (protocol == table.procedures.end()) return nullptr;
  const auto block = protocol->second.find(trial.block_name);
  return block == protocol->second.end() ? nullptr : &block->second;
}

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

std::optional<protocols::Easier> easier_of_adaptive(const protocols::ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<protocols::Staircase>(&spec)) return staircase->easier;
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&spec)) return quest->function.easier;
  if (const auto* limits = std::get_if<protocols::Limits>(&spec)) return limits->easier;
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
    int number = 0;
    if (const auto* spec = spec_of(track, *own.front(), table, number)) {
      replay(track, *own.front(), table, *spec, number);
    } else {
      track.reversals = reversals_of(track);
    }
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
