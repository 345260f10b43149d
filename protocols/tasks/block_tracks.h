#pragma once
// What the trials of a block are made of: its tracks, their intervals, and streams of chance.

#include <cstdint>
#include <vector>

#include "protocols/schedule.h"
#include "stimuli/random.h"

namespace palpate::protocols {

// Of random streams: part of the meaning of a seed, never to be renumbered. schedule.cpp has 1
// to 4.
enum TaskUse : std::uint64_t {
  kTaskOrder = 1,
  kTaskPosition = 2,
  kTaskOrientation = 3,
  kTaskCatch = 4,
  kTaskTracks = 5
};
/// \param seed  of the protocol. \param block  its index
stimuli::Random task_stream(std::uint64_t seed, int participant, std::uint64_t block, TaskUse use,
                            std::uint64_t number = 0);

/// What a track varies the level of.
struct BlockTrack {
  int stimulus = 0;
  RendererKind renderer = RendererKind::point;
  const ProcedureSpec* procedure = nullptr;  ///< of the block; nullptr: none
};

/// In the order of their numbers, which begin with 1: the procedure varies fastest.
std::vector<BlockTrack> tracks_of(const TaskBlock& block);
/// The number of trials with catch trials among them.
long long with_catch_trials(const TaskBlock& block, long long trials);
/// The intervals of a trial whose stimulus, renderer and level are set.
/// \param position  of the comparison, from 0
void set_intervals(const TaskBlock& block, int position, Trial& trial);

}  // namespace palpate::protocols
