#pragma once
// The order of a session's blocks, how many trials they have, and what the seed draws of adaptive
// ones. The tracks of adaptive blocks are mixed in rounds, one trial of each track. Catch trials of
// an adaptive block are spread at random over every 20 trials.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// The blocks of a session in the order in which a participant gets them: indices.
std::vector<int> blocks_in_order(const Protocol& protocol, int participant_number, int session);
/// The number of successive participant numbers after which the orders of blocks, or of renderers
/// in the study of shapes, repeat; 1: they are the same for everybody, or mixed.
int block_orders(const Protocol& protocol);
/// Whether another program chooses the stimuli: only `palpate serve` allows one.
bool is_external(const Protocol& protocol);
/// Whether answers choose the block's levels.
bool is_adaptive(const TaskBlock& block);
/// The first block, of any group, that a program must choose levels for; nullptr: none.
const TaskBlock* block_that_asks(const Protocol& protocol);
/// The procedure that chooses the level of a trial of the block; nullptr: none.
const ProcedureSpec* procedure_of(const TaskBlock& block, const Trial& trial);
/// The most trials of a participant in a block, not counting unanswered ones.
long long most_trials_of(const TaskBlock& block);
/// The trials of a participant that adaptive blocks usually take.
long long expected_trials_of(const TaskBlock& block);
/// Movements of a kind to all targets, with one stimulus and renderer. \pre a block of reaching
long long reaches_of_track(const TaskBlock& block, ReachTrial kind);
/// An adaptive block ends after this many unanswered trials, whose levels are repeated: nobody is
/// there. A quarter of most_trials_of, at least 10.
std::size_t most_unanswered(const TaskBlock& block);

/// The stimuli of each track of a block whose cells share tracks, in the order of its answered
/// trials, for as many as it may have.
std::vector<std::vector<int>> shared_track_order(const Protocol& protocol, int participant_number,
                                                 int block);

/// The part of a trial of an adaptive block that the seed determines, whatever the answers are.
struct DrawnTrial {
  bool catch_trial = false;
  int position = 0;  ///< of the comparison, from 0
  Quat orientation{1, 0, 0, 0};
};
/// \param block  index \param shown  from 0, in the block
DrawnTrial drawn_trial(const Protocol& protocol, int participant_number, int block,
                       std::size_t shown);
/// The tracks of an adaptive block, from 1, in the order of a round (from 0) in which none has
/// ended.
std::vector<int> track_order(const Protocol& protocol, int participant_number, int block,
                             std::uint64_t round);

}  // namespace palpate::protocols
