#include "protocols/tasks/block_tracks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "protocols/factors.h"

namespace palpate::protocols {
namespace {

constexpr std::uint64_t kTaskStream = 5;      // schedule.cpp uses 1 to 4
constexpr std::uint64_t kCellStreams = 1000;  // more than blocks of a protocol

/// The stimulus that is felt in a reach; -1: nothing.
int felt_on_the_way(const ReachingSpec& reaching, const Trial& trial) {
  if (trial.reach == ReachTrial::field) return trial.stimulus;
  if (trial.reach == ReachTrial::none) return -1;
  return reaching.channels.at(static_cast<std::size_t>(*trial.level) - 1);
}

int in_cell(const std::map<int, int>& of_cells, int stimulus, std::optional<int> plain) {
  const auto found = of_cells.find(stimulus);
  return found != of_cells.end() ? found->second : plain.value_or(-1);
}

/// How many stimuli have tracks of their own, the first of the block: those of its first cell,
/// where cells share tracks.
std::size_t stimuli_with_tracks(const TaskBlock& block) {
  return block.stimuli.size() / (block.cells_share_tracks ? cells_of(block) : 1);
}

}  // namespace

Random task_stream(std::uint64_t seed, int participant, std::uint64_t block, TaskUse use,
                   std::uint64_t number) {
  return Random(seed, {static_cast<std::uint64_t>(participant), kTaskStream, block, use, number});
}

std::vector<BlockTrack> tracks_of(const TaskBlock& block) {
  std::vector<BlockTrack> tracks;
  for (const int stimulus : std::span(block.stimuli).first(stimuli_with_tracks(block))) {
    for (const RendererKind renderer : block.renderers) {
      if (block.procedures.empty()) tracks.push_back({stimulus, renderer, nullptr});
      for (const ProcedureSpec& procedure : block.procedures)
        tracks.push_back({stimulus, renderer, &procedure});
    }
  }
  return tracks;
}

std::vector<int> cells_in_round(const TaskBlock& block, std::uint64_t seed, int participant,
                                std::size_t track, std::uint64_t round) {
  const std::size_t own = stimuli_with_tracks(block);
  const std::size_t of_stimulus = tracks_of(block).size() / own;
  std::vector<int> cells;
  for (std::size_t i = track / of_stimulus; i < block.stimuli.size(); i += own)
    cells.push_back(block.stimuli[i]);
  Random random = task_stream(seed, participant, stream_of(block), kTaskCells, track);
  for (std::uint64_t i = 0; i <= round; ++i) random.shuffle(cells);
  return cells;
}

int first_track(const TaskBlock& block) {
  return 1 + static_cast<int>(block.cell.value_or(0) * tracks_of(block).size());
}

std::uint64_t stream_of(std::size_t place, std::optional<std::size_t> cell) {
  return place + (cell ? kCellStreams * (*cell + 1) : 0);
}

std::uint64_t stream_of(const TaskBlock& block) { return stream_of(block.place, block.cell); }

long long repetitions_of_track(const TaskBlock& block) {
  const std::size_t targets = block.reaching ? block.reaching->targets.size() : 1;
  return block.repetitions * static_cast<long long>(targets);
}

long long with_catch_trials(const TaskBlock& block, long long trials) {
  return trials +
         std::llround(static_cast<double>(trials) * block.catch_trials / (1 - block.catch_trials));
}

void set_intervals(const TaskBlock& block, int position, Trial& trial) {
  const Interval asked{trial.stimulus, trial.renderer, trial.level, false, trial.point};
  Interval standard{in_cell(block.standard_of, trial.stimulus, block.standard),
                    block.standard_renderer.value_or(trial.renderer), std::nullopt, true};
  if (std::ranges::any_of(block.dimensions, [](const auto& one) { return one.applies_to(true); }))
    standard.point = trial.point;
  switch (block.task) {
    case TaskKind::identify:
    case TaskKind::external:
      trial.intervals = {asked};
      break;
    case TaskKind::compare:
      trial.intervals.assign(static_cast<std::size_t>(block.intervals), standard);
      if (!trial.catch_trial) trial.intervals[static_cast<std::size_t>(position)] = asked;
      break;
    case TaskKind::detect:
      trial.intervals = {asked};
      if (trial.catch_trial)
        trial.intervals[0] = {in_cell(block.absent_of, trial.stimulus, block.absent),
                              trial.renderer};
      break;
    case TaskKind::rate:
      trial.intervals = {asked};
      if (block.standard) trial.intervals.insert(trial.intervals.begin(), standard);
      break;
    case TaskKind::adjust:
      trial.intervals = {asked, standard};  // alternating as often as the participant likes
      break;
    case TaskKind::reach:
      trial.intervals = {{felt_on_the_way(*block.reaching, trial), trial.renderer}};
      return;  // a catch trial has a target, too
  }
  if (!trial.catch_trial) return;
  trial.level.reset();
  trial.point.clear();
}

}  // namespace palpate::protocols
