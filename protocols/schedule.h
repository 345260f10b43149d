#pragma once
// The trials of a participant, in order. Everything follows from the protocol's seed and the
// participant number alone, on every machine and compiler.
//
// Numbering. Sessions count from 1, trials from 1 within their session. Blocks count from 1 through
// all sessions of the participant, and each uninterrupted sequence is a block of its own: the
// practice before a renderer's first block, the warm-up at the start of the second and later
// sessions, every block of trials; a block that is split by the end of a session continues under a
// new number. So session and block never decrease, and (session, trial) is unique.
//
// The limits max_run and min_distance hold within each block and each round of practice, not across
// their borders, where there are breaks or instructions.

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <vector>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// One presentation within a trial.
struct Interval {
  int stimulus = 0;  ///< index into Protocol::stimuli; -1: nothing
  RendererKind renderer = RendererKind::point;
  std::optional<double> level = std::nullopt;  ///< none: the stimulus unchanged
  bool standard = false;                       ///< the other interval is compared with it
  /// Of the block's dimensions, those of this interval and of others; empty: as for `level`.
  LevelPoint point = {};
};

/// One scheduled presentation. Numbers count from 1; `trial` counts within the session.
struct Trial {
  int session = 1, block = 1, trial = 1;
  RendererKind renderer = RendererKind::point;
  int stimulus = 0;  ///< index into Protocol::stimuli
  Quat orientation{1, 0, 0, 0};
  bool practice = false;  ///< practice or warm-up: excluded from analysis
  // Stimulus and renderer are those of the judged interval.
  int task_block = 0;                          ///< index into Protocol::blocks
  int track = 1;                               ///< 1, 2, ...: stimulus, renderer and procedure
  std::optional<double> level = std::nullopt;  ///< adjust: the starting level
  bool catch_trial = false;
  std::vector<Interval> intervals = {};  ///< in order of presentation
  ReachTrial reach = ReachTrial::field;  ///< reach; `level` is the number of the target, from 1
  LevelPoint point = {};  ///< of the block's dimensions; empty: none, or a catch trial
};

/// The block of a trial.
inline const TaskBlock& block_of(const Protocol& protocol, const Trial& trial) {
  return protocol.blocks[static_cast<std::size_t>(trial.task_block)];
}

/// Whether things are seen in an interval of a block, if its stimulus has any.
inline bool is_seen(const TaskBlock& block, const Interval& interval) {
  using Seen = TaskBlock::IntervalsSeen;
  return block.intervals_seen == Seen::both ||
         interval.standard == (block.intervals_seen == Seen::standard);
}

/// The study of shapes that a protocol of version 1 describes, as its only block: to identify one
/// of all stimuli, in their order.
TaskBlock shapes_block(const Protocol& protocol);

/// The limits on the order of trials cannot be satisfied; what() says why and what can be changed.
class ScheduleError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The study of shapes: the trials of participant number 1, 2, ... in order. Depends on the
/// protocol's seed and the number alone. Practice appears once, as its first round.
/// \throws ScheduleError if the constraints have no solution, std::invalid_argument for a
/// participant number below 1.
std::vector<Trial> schedule(const Protocol& protocol, int participant_number);

/// Round 1, 2, ... of practice with a renderer; round 1 is the one in schedule(). For an
/// interleaved protocol, a round mixes all renderers and `renderer` does not matter. Trials count
/// from 1 within the round, session and block stay 1: the session that shows a further round
/// numbers it.
/// \throws as schedule()
std::vector<Trial> practice_round(const Protocol& protocol, int participant_number,
                                  RendererKind renderer, int round);

/// A block of trials for analysis without numbers and orientations: `repetitions` of each stimulus
/// with each renderer of `group`, mixed.
/// \param number  from 0, among the blocks of these renderers
/// \throws ScheduleError
std::vector<Trial> block_of_trials(const Protocol& protocol, int participant_number,
                                   const std::vector<RendererKind>& group, int number,
                                   int repetitions);
/// Draws the orientations of a participant's trials for analysis, all of them in order.
void draw_orientations(const Protocol& protocol, int participant_number,
                       const std::vector<Trial*>& trials);

/// The number of successive participant numbers after which the orders of renderers repeat.
int renderer_orders(const Protocol& protocol);

/// Trials for analysis, without practice and warm-up, in all sessions of a participant.
long long main_trials(const Protocol& protocol);

}  // namespace palpate::protocols
