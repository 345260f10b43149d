#pragma once
// The trials of a session of version 2, one at a time: a pure function of protocol, session,
// participant number and the answers so far, the same on every machine and compiler.
//
// Identification without levels has the order and orientations of version 1 for the same design
// (schedule.h), if a block has one renderer, or several without limits on the order. Other blocks
// without adaptive procedures have a random order under the limits of the block. The tracks of
// adaptive blocks are mixed in rounds, one trial of each track. Catch trials of an adaptive block
// are spread at random over every 20 trials.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/procedures/procedure.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// The procedures that chose a block's levels.
struct BlockProcedures {
  std::uint64_t protocol_seed = 0;
  std::uint64_t index = 0;                ///< of the block in its protocol
  std::vector<ProcedureSpec> specs;       ///< empty: none
  bool asks_smaller = false;              ///< compare: the interval with the smaller level
  std::string level_unit{};               ///< "N/m", ...; "1" without one, "": nothing is varied
  std::vector<ScaleStep> rating_steps{};  ///< rate: of a labelled scale; empty: none

  /// The spec of a track, from 1.
  /// \pre specs is not empty
  const ProcedureSpec& spec_of(int track) const;
  /// A track before its first answer, as TaskPlan begins it.
  Procedure begin(int participant_number, int track) const;
};

/// The procedures of each block, by its name, of a protocol of version 2, without the files that
/// its stimuli need: for the analysis of an old study. Empty: version 1.
/// \throws InputError
std::map<std::string, BlockProcedures> procedures_of_blocks(const std::string& text,
                                                            const std::string& file_name);

/// The outcome of a trial, as far as the next ones depend on it.
struct TrialOutcome {
  bool correct = false;
  bool success = false;  ///< the comparison chosen, "yes", "different"
  bool answered = true;  ///< false: a time-out; an adaptive level is repeated
  /// The level shown, if not the plan's; none: the plan's.
  std::optional<double> level = std::nullopt;
};

/// The contents of a trial of an external block.
struct TrialChoice {
  int stimulus = 0;  ///< index into Protocol::stimuli, one of the block's
  RendererKind renderer = RendererKind::point;
  std::optional<double> level = std::nullopt;      ///< within the block's
  std::optional<Quat> orientation = std::nullopt;  ///< none: the plan's
  /// In order, where the block has several; stimulus, renderer and level above are those of the
  /// judged one. Empty: one interval.
  std::vector<Interval> intervals = {};
};

class TaskPlan {
 public:
  /// \param protocol  of version 2; must outlive it
  TaskPlan(const Protocol& protocol, int participant_number, int session);

  bool finished() const { return !next_.has_value(); }
  const Trial& next() const { return *next_; }  ///< \pre not finished()
  std::size_t done() const { return done_; }
  std::size_t size() const;           ///< at most, as far as known now
  std::size_t expected_size() const;  ///< likewise, if adaptive blocks take their usual course
  int last_block() const { return first_block_ + static_cast<int>(order_.size()) - 1; }
  bool block_begins() const { return shown_ == 0; }
  /// Shows the next trial at another level, which the procedure records with the answer.
  /// \pre it belongs to an adaptive block and is not a catch trial
  void propose(double level);
  /// Sets the next trial as another program chose it.
  /// \pre it belongs to an external block
  void choose(const TrialChoice& choice);
  void answered(const TrialOutcome& outcome);
  /// The tracks of an adaptive block in progress.
  const std::optional<InterleavedTracks>& tracks() const { return tracks_; }

 private:
  void begin_block();
  void add_round();
  bool block_continues();
  bool criterion_met() const;
  void find_next();
  Trial adaptive_trial() const;
  const TaskBlock& block() const;
  std::uint64_t block_index() const { return static_cast<std::uint64_t>(order_[at_]); }

  const Protocol* protocol_;
  int participant_number_, session_;
  std::vector<int> order_;            ///< of the session's blocks: indices into Protocol::blocks
  int first_block_ = 1;               ///< number of the first block
  std::size_t at_ = 0;                ///< into order_
  std::size_t done_ = 0, shown_ = 0;  ///< in the session, in the block
  std::size_t unanswered_ = 0;        ///< in an adaptive block
  std::vector<Trial> fixed_;          ///< of the block as far as known; empty: adaptive
  std::uint64_t rounds_ = 0;          ///< rounds in fixed_; more than one if practice continues
  std::vector<bool> right_;           ///< answers to the block
  std::optional<InterleavedTracks> tracks_;
  std::optional<Trial> next_;
};

/// What the seed determines of a trial of an adaptive block, whatever the answers are.
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

/// The blocks of a session in the order in which a participant gets them: indices.
std::vector<int> blocks_in_order(const Protocol& protocol, int participant_number, int session);
/// The number of successive participant numbers after which the orders of blocks repeat; 1: they
/// are the same for everybody.
int block_orders(const Protocol& protocol);
/// Whether another program chooses the stimuli: only `palpate serve` allows one.
bool is_external(const Protocol& protocol);
/// Whether answers choose the block's levels.
bool is_adaptive(const TaskBlock& block);
/// The most trials of a participant in a block, not counting unanswered ones.
long long most_trials_of(const TaskBlock& block);
/// The trials of a participant that adaptive blocks usually take.
long long expected_trials_of(const TaskBlock& block);
/// An adaptive block ends after this many unanswered trials, whose levels are repeated: nobody is
/// there. A quarter of most_trials_of, at least 10.
std::size_t most_unanswered(const TaskBlock& block);
/// \throws ScheduleError: the limits on the order of its trials cannot be met
void check_order(const Protocol& protocol, int block);

}  // namespace palpate::protocols
