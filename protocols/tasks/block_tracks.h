#pragma once
// The tracks of a block, the intervals of its trials, and its random streams.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// The stimulus, renderer and procedure of a track.
struct BlockTrack {
  int stimulus = 0;  ///< of tracks that cells share: in the first cell
  RendererKind renderer = RendererKind::point;
  const ProcedureSpec* procedure = nullptr;  ///< of the block; nullptr: none
};

/// The tracks in order of their numbers, from 1: the procedure varies fastest.
std::vector<BlockTrack> tracks_of(const TaskBlock& block);

/// The stimuli of a track that cells share, one of each cell, in the order of one of its rounds of
/// as many answered trials. \pre block.cells_share_tracks
/// \param seed  of the protocol \param track  index into tracks_of(block) \param round  from 0
std::vector<int> cells_in_round(const TaskBlock& block, std::uint64_t seed, int participant,
                                std::size_t track, std::uint64_t round);

/// The number of the first track: the cells of a block number theirs together.
int first_track(const TaskBlock& block);

/// The number of trials of a track without procedure; reach: of all its targets.
long long repetitions_of_track(const TaskBlock& block);

/// The number of trials with catch trials included.
long long with_catch_trials(const TaskBlock& block, long long trials);

/// Sets the intervals of a trial whose stimulus, renderer and level are set.
/// \param position  of the comparison, from 0
void set_intervals(const TaskBlock& block, int position, Trial& trial);

/// The uses of a block's random streams. Part of the meaning of a seed: never renumber them.
enum TaskUse : std::uint64_t {
  kTaskOrder = 1,
  kTaskPosition = 2,
  kTaskOrientation = 3,
  kTaskCatch = 4,
  kTaskTracks = 5,
  kTaskCells = 6
};
/// The number of a block's random streams: its place, or one of its own for a cell apart, so that a
/// block has the same streams whatever factors others cross.
std::uint64_t stream_of(std::size_t place, std::optional<std::size_t> cell);
std::uint64_t stream_of(const TaskBlock& block);
/// \param seed  of the protocol
/// \param block  stream_of it
Random task_stream(std::uint64_t seed, int participant, std::uint64_t block, TaskUse use,
                   std::uint64_t number = 0);

}  // namespace palpate::protocols
