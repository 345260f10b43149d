#pragma once
// The trials of a session, one at a time: a pure function of protocol, session, participant number
// and the answers so far, the same on every machine and compiler. Feeding it the recorded answers
// restores the point of an interruption.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocols/procedures/procedure.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::protocols {

/// The outcome of a trial, as far as the next ones depend on it.
struct TrialOutcome {
  bool correct = false;
  bool success = false;  ///< the comparison chosen, "yes", "different"
  bool answered = true;  ///< false: a time-out; an adaptive level is repeated
  /// The level shown, if not the plan's; none: the plan's.
  std::optional<double> level = std::nullopt;
  LevelPoint point = {};  ///< likewise, of several dimensions
  /// Number of the block in which it was shown. If it is above that of the next trial, a program
  /// ended the blocks before. 0: that of the next trial.
  int block = 0;
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

/// Trials without a break.
struct TrialSequence {
  int block = 0;  ///< index into Protocol::blocks
  /// Its trials in round 0, 1, ...; adaptive: not called.
  std::function<std::vector<Trial>(std::uint64_t round)> round;
  std::optional<PracticeCriterion> criterion;
  std::function<long long()> expected_trials;
  std::optional<long long> most_trials;  ///< none: those of its rounds
};
/// Those of a session.
struct SessionSequences {
  int first_block = 1;  ///< number of the first
  std::vector<TrialSequence> all = {};
};

/// The order of a study's trials, and what comes in it.
class OrderRule {
 public:
  virtual ~OrderRule() = default;
  /// \param protocol  must outlive the result
  virtual SessionSequences sequences(const Protocol& protocol, int participant_number,
                                     int session) const = 0;
  /// "renderers" or "blocks": the order of which differs over participants.
  virtual const char* conditions_in_words() const = 0;
  /// Their names as they come, each at least once.
  virtual std::vector<std::string> conditions(const Protocol& protocol,
                                              int participant_number) const = 0;
  /// Which of them a trial has.
  virtual std::string condition_of(const std::string& renderer, const std::string& block) const = 0;
};
/// The study of shapes, through all sessions: schedule.h.
const OrderRule& order_of_shapes();
inline bool is_study_of_shapes(const Protocol& protocol) {
  return protocol.order_rule == &order_of_shapes();
}

/// The blocks that the protocol lists by their names. The study of shapes is none of them.
std::vector<const TaskBlock*> listed_blocks(const Protocol& protocol);

/// Trials of a block in all sessions, practice and warm-up included.
struct TrialCounts {
  long long expected = 0;  ///< if adaptive blocks take their usual course
  long long most = 0;      ///< in the first round of practice
};
/// Of each block of a protocol.
std::vector<TrialCounts> trial_counts(const Protocol& protocol);

class SessionPlan {
 public:
  /// \param protocol  must outlive it; the participant gets that of the own group
  SessionPlan(const Protocol& protocol, int participant_number, int session);

  bool finished() const { return !next_.has_value(); }
  const Trial& next() const { return *next_; }  ///< \pre not finished()
  /// The block of the next trial. \pre not finished()
  const TaskBlock& block() const;
  std::size_t done() const { return done_; }
  std::size_t size() const;           ///< at most, as far as known now
  std::size_t expected_size() const;  ///< likewise, if adaptive blocks take their usual course
  /// The number of its last block.
  int last_block() const {
    return sequences_.first_block + static_cast<int>(sequences_.all.size()) - 1;
  }
  /// True at the first trial of a block.
  bool block_begins() const { return shown_ == 0; }
  /// Trials before the next one in its block.
  std::size_t done_in_block() const { return finished() ? 0 : shown_; }
  /// Whether the trial before the next one was practice, of this session.
  bool after_practice() const { return after_practice_; }
  /// Shows the next trial at another level, which the procedure records with the answer.
  /// \pre it belongs to an adaptive block and is not a catch trial
  void propose(double level);
  /// The same of a point. \pre the block's levels have several dimensions
  void propose(const LevelPoint& point);
  /// Ends the block of the next trial before it: a program has enough.
  /// \pre it is adaptive
  void end_block();
  /// Ends adaptive blocks until the next trial is in a block of this number, or in one that does
  /// not end so.
  void continue_in(int block);
  /// Sets the next trial as another program chose it.
  /// \pre it belongs to an external block
  void choose(const TrialChoice& choice);
  /// The next trial has been answered.
  void answered(const TrialOutcome& outcome);
  /// The tracks of an adaptive block in progress.
  const std::optional<InterleavedTracks>& tracks() const { return tracks_; }

 private:
  const TrialSequence& sequence() const { return sequences_.all[at_]; }
  std::size_t block_index() const { return static_cast<std::size_t>(sequence().block); }
  void begin_sequence();
  void add_round();
  bool sequence_continues();
  bool criterion_met() const;
  void find_next();
  int stimulus_of_shared(std::size_t track) const;
  Trial adaptive_trial() const;
  long long most_in_sequence() const;

  const Protocol* protocol_;
  int participant_number_, session_;
  SessionSequences sequences_;
  std::size_t at_ = 0;                ///< into sequences_.all
  std::size_t done_ = 0, shown_ = 0;  ///< in the session, in the sequence
  std::size_t unanswered_ = 0;        ///< in an adaptive block
  bool ended_ = false;                ///< likewise, before its procedures have
  std::vector<Trial> fixed_;          ///< of the sequence as far as known; empty: adaptive
  std::uint64_t rounds_ = 0;          ///< in fixed_; more than one if practice continues
  std::optional<PracticeCriterion> criterion_;  ///< of the sequence
  std::vector<bool> right_;                     ///< answers to the sequence
  bool after_practice_ = false;
  std::optional<InterleavedTracks> tracks_;
  std::optional<Trial> next_;
};

}  // namespace palpate::protocols
