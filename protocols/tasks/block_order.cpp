#include "protocols/tasks/block_order.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <variant>

#include "data/base/random.h"
#include "protocols/order.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"
#include "protocols/schedule.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/block_trials.h"

namespace palpate::protocols {
namespace {

constexpr std::size_t kCatchWindow = 20;    // trials
constexpr long long kLeastUnanswered = 10;  // trials

/// Whether trial `shown` (from 0) of an adaptive block is a catch trial.
bool is_catch_trial(const Protocol& protocol, int participant, std::uint64_t block,
                    std::size_t shown) {
  const TaskBlock& asked = protocol.blocks[static_cast<std::size_t>(block)];
  const double share = asked.catch_trials;
  if (!(share > 0)) return false;
  const auto window = std::max(kCatchWindow, static_cast<std::size_t>(std::lround(1 / share)));
  const auto count = std::max(
      std::size_t{1}, static_cast<std::size_t>(std::lround(share * static_cast<double>(window))));
  std::vector<int> marks(window, 0);
  std::fill(marks.begin(), marks.begin() + static_cast<std::ptrdiff_t>(count), 1);
  Random random =
      task_stream(protocol.seed, participant, stream_of(asked), kTaskCatch, shown / window);
  random.shuffle(marks);
  return marks[shown % window] == 1;
}

/// The number of a block's cells that stand apart, from index `first` on; 1: none do.
int cells_from(const Protocol& protocol, int first) {
  const auto begin = protocol.blocks.begin() + first;
  return static_cast<int>(std::find_if(begin + 1, protocol.blocks.end(),
                                       [&](const TaskBlock& block) {
                                         return block.place != begin->place || !block.cell;
                                       }) -
                          begin);
}

/// The rows of the squares that order blocks, and cells within them.
struct SquareRows {
  int blocks = 1, cells = 1;  ///< after which the orders of all sessions repeat

  int of_both() const { return std::lcm(blocks, cells); }
  /// The participant's number for the square of the cells of a block. Each time that the rows of
  /// both repeat they are shifted, so that every order of cells meets every order of blocks.
  /// \param crossed  blocks of cells before this one: they begin with other rows
  int of_cells(int number, int crossed) const {
    return number + crossed + (blocks > 1 ? (number - 1) / of_both() : 0);
  }
  int period() const { return blocks > 1 ? of_both() * cells : cells; }
};

SquareRows square_rows(const Protocol& protocol) {
  SquareRows out;
  std::map<int, int> blocks;  // by session
  for (int i = 0; i < static_cast<int>(protocol.blocks.size());) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(i)];
    const int cells = cells_from(protocol, i);
    out.cells = std::lcm(out.cells, latin_square_rows(cells));
    if (!block.practice) ++blocks[block.session];
    i += cells;
  }
  for (const auto& [session, count] : blocks) {
    if (protocol.blocks_counterbalanced)
      out.blocks = std::lcm(out.blocks, latin_square_rows(count));
  }
  return out;
}

}  // namespace

std::vector<int> blocks_in_order(const Protocol& protocol, int participant_number, int session) {
  std::vector<std::vector<int>> units(1);  // each a block with the practice before it
  const int number = protocol.groups.row(participant_number);
  const SquareRows rows = square_rows(protocol);
  int crossed = 0;  // blocks whose cells stand apart
  for (int i = 0; i < static_cast<int>(protocol.blocks.size());) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(i)];
    const int cells = cells_from(protocol, i);
    if (block.session == session) {
      for (const int cell : latin_square_row(cells, rows.of_cells(number, crossed)))
        units.back().push_back(i + cell);
      if (!block.practice) units.emplace_back();
    }
    if (cells > 1) ++crossed;
    i += cells;
  }
  const std::vector<int> last = std::move(units.back());  // practice after the last block
  units.pop_back();
  std::vector<int> order;
  const int count = static_cast<int>(units.size());
  const std::vector<int> row = protocol.blocks_counterbalanced && count > 1
                                   ? latin_square_row(count, number)
                                   : std::vector<int>();
  for (int i = 0; i < count; ++i) {
    const int at = row.empty() ? i : row[static_cast<std::size_t>(i)];
    const auto& unit = units[static_cast<std::size_t>(at)];
    order.insert(order.end(), unit.begin(), unit.end());
  }
  order.insert(order.end(), last.begin(), last.end());
  return order;
}

int block_orders(const Protocol& protocol) {
  // Version 2 fixes the order of renderers, version 1 that of blocks.
  return renderer_orders(protocol) * square_rows(protocol).period();
}

bool is_external(const Protocol& protocol) {
  return std::ranges::any_of(
      protocol.blocks, [](const TaskBlock& block) { return block.task == TaskKind::external; });
}

bool is_adaptive(const TaskBlock& block) {
  return std::any_of(block.procedures.begin(), block.procedures.end(), [](const auto& spec) {
    return !std::holds_alternative<ConstantStimuli>(spec);
  });
}

const TaskBlock* block_that_asks(const Protocol& protocol) {
  const auto found = std::ranges::find_if(protocol.blocks, [&](const TaskBlock& block) {
    return std::ranges::any_of(block.procedures, is_asked);
  });
  if (found != protocol.blocks.end()) return &*found;
  for (const auto& group : protocol.group_protocols) {
    if (const TaskBlock* const block = block_that_asks(*group)) return block;
  }
  return nullptr;
}

const ProcedureSpec* procedure_of(const TaskBlock& block, const Trial& trial) {
  return tracks_of(block)[static_cast<std::size_t>(trial.track - first_track(block))].procedure;
}

long long most_trials_of(const TaskBlock& block) {
  if (block.criterion) return block.criterion->most_trials;
  if (block.task == TaskKind::external) return block.repetitions;
  long long trials = 0;
  for (const BlockTrack& track : tracks_of(block)) {
    trials += track.procedure == nullptr ? repetitions_of_track(block)
                                         : static_cast<long long>(most_trials(*track.procedure));
  }
  return with_catch_trials(block, trials);
}

long long reaches_of_track(const TaskBlock& block, ReachTrial kind) {
  const long long all = repetitions_of_track(block);
  const long long clamps = std::llround(block.reaching->clamp_share * static_cast<double>(all));
  const long long catches = std::llround(block.reaching->catch_share * static_cast<double>(all));
  if (kind == ReachTrial::clamp) return clamps;
  return kind == ReachTrial::none ? catches : all - clamps - catches;
}

long long expected_trials_of(const TaskBlock& block) {
  if (!is_adaptive(block)) return most_trials_of(block);
  double trials = 0;
  for (const BlockTrack& track : tracks_of(block))
    trials += expected_trials(*track.procedure, Procedure(*track.procedure, 0));
  return with_catch_trials(block, std::llround(trials));
}

std::size_t most_unanswered(const TaskBlock& block) {
  return static_cast<std::size_t>(std::max(kLeastUnanswered, most_trials_of(block) / 4));
}

DrawnTrial drawn_trial(const Protocol& protocol, int participant_number, int block,
                       std::size_t shown) {
  const auto index = static_cast<std::uint64_t>(block);
  const TaskBlock& asked = protocol.blocks[static_cast<std::size_t>(block)];
  DrawnTrial out;
  out.catch_trial = is_catch_trial(protocol, participant_number, index, shown);
  Random random =
      task_stream(protocol.seed, participant_number, stream_of(asked), kTaskPosition, shown + 1);
  out.position = static_cast<int>(random.below(static_cast<std::uint64_t>(asked.intervals)));
  out.orientation = orientation_in_block(protocol, participant_number, index, shown);
  return out;
}

std::vector<std::vector<int>> shared_track_order(const Protocol& protocol, int participant_number,
                                                 int block) {
  const TaskBlock& asked = protocol.blocks[static_cast<std::size_t>(block)];
  std::vector<std::vector<int>> out;
  for (const BlockTrack& track : tracks_of(asked)) {
    std::vector<int>& stimuli = out.emplace_back();
    for (std::uint64_t round = 0; stimuli.size() < most_trials(*track.procedure); ++round) {
      const std::vector<int> cells =
          cells_in_round(asked, protocol.seed, participant_number, out.size() - 1, round);
      stimuli.insert(stimuli.end(), cells.begin(), cells.end());
    }
  }
  return out;
}

std::vector<int> track_order(const Protocol& protocol, int participant_number, int block,
                             std::uint64_t round) {
  const TaskBlock& asked = protocol.blocks[static_cast<std::size_t>(block)];
  std::vector<std::size_t> tracks(tracks_of(asked).size());
  for (std::size_t i = 0; i < tracks.size(); ++i) tracks[i] = i;
  std::vector<int> out;
  for (const std::size_t track : round_of_tracks(
           task_stream(protocol.seed, participant_number, stream_of(asked), kTaskTracks).next(),
           round, std::move(tracks)))
    out.push_back(first_track(asked) + static_cast<int>(track));
  return out;
}

}  // namespace palpate::protocols
