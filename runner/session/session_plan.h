#pragma once
// The schedule of one session during its run, and the scenes of its trials of version 2.

#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/tasks/task_plan.h"
#include "runner/scene_builder.h"

namespace palpate::runner::session {

// The scenes of a session of version 2: stimuli at levels that depend on answers, built on demand.

class LevelScenes {
 public:
  /// \param protocol  must outlive it
  explicit LevelScenes(const protocols::Protocol& protocol);

  /// The scene of an interval of a trial, in the trial's orientation.
  rendering::Scene scene(const protocols::Trial& trial, const protocols::Interval& interval);
  /// Its edges, valid until the next call; empty without a stimulus.
  const SharpEdges& edges(const protocols::Trial& trial, const protocols::Interval& interval);

 private:
  const StimulusLibrary& library(const protocols::Trial& trial,
                                 const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  protocols::Protocol one_;  ///< the protocol with one stimulus
  /// By block, stimulus and level; only the newest ones are kept.
  std::map<std::tuple<int, int, std::optional<double>>, std::unique_ptr<const StimulusLibrary>>
      known_;
};

/// The object at the interval's level, placed in the world: for drawing.
stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval);

/// The trials of one session in order, extended by rounds of practice until the protocol's
/// criterion is met. Feeding it the recorded answers restores the point of an interruption.
class SessionPlan {
 public:
  SessionPlan(const protocols::Protocol& protocol, int participant_number, int session);

  bool finished() const { return tasks_ ? tasks_->finished() : next_ == trials_.size(); }
  /// \pre not finished()
  const protocols::Trial& next() const { return tasks_ ? tasks_->next() : trials_[next_]; }
  /// The block of tasks of the next trial; nullptr: it belongs to none, or the session is finished.
  const protocols::TaskBlock* next_block() const;
  std::size_t done() const { return tasks_ ? tasks_->done() : next_; }
  /// As far as known now.
  std::size_t size() const { return tasks_ ? tasks_->size() : trials_.size(); }
  /// The number of its last block.
  int blocks() const {
    if (tasks_) return tasks_->last_block();
    return trials_.empty() ? 0 : trials_.back().block;
  }
  /// True at the first trial of a block (of a session, for the first).
  bool block_begins() const;
  std::size_t done_in_block() const { return done_in_block_; }  ///< of the next trial
  /// Whether the trial before the next one was practice, of this session.
  bool after_practice() const { return after_practice_; }
  /// Version 2: sets another level for the next trial, of an adaptive block.
  void propose(double level) {
    if (tasks_) tasks_->propose(level);
  }
  /// Version 2: an external program chooses the next trial, of an external block.
  void choose(const protocols::TrialChoice& choice) {
    if (tasks_) tasks_->choose(choice);
  }
  /// The next trial has been answered.
  void answered(const protocols::TrialOutcome& outcome);
  void answered(bool correct) { answered(protocols::TrialOutcome{correct, correct}); }

 private:
  void go_on(const protocols::TrialOutcome& outcome);
  void judge_practice();

  const protocols::Protocol* protocol_;
  int participant_number_;
  std::vector<protocols::Trial> trials_;
  std::size_t next_ = 0;
  std::size_t done_in_block_ = 0;
  bool after_practice_ = false;
  int first_practice_block_ = 0;              ///< blocks before it are warm-up
  int round_ = 1;                             ///< of the practice under way
  int correct_ = 0, shown_ = 0;               ///< in that round
  std::optional<protocols::TaskPlan> tasks_;  ///< version 2, instead of all the members above
};

/// The outcome of a recorded trial, for SessionPlan::answered.
protocols::TrialOutcome outcome_of(const data::TrialRecord& record);

}  // namespace palpate::runner::session
