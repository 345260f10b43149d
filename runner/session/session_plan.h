#pragma once
// The schedule of one session during its run, and the scenes of its trials.

#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <variant>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/tasks/task_plan.h"
#include "runner/scene_builder.h"

namespace palpate::runner::session {

/// The scenes of a session. Stimuli at levels that depend on answers are built on demand.
class SessionScenes {
 public:
  /// \param protocol  must outlive it, as must
  /// \param library   of the protocol's stimuli, without levels; null: builds those, too, on demand
  explicit SessionScenes(const protocols::Protocol& protocol,
                         const StimulusLibrary* library = nullptr);

  /// The scene of an interval of a trial, in the trial's orientation.
  rendering::Scene scene(const protocols::Trial& trial, const protocols::Interval& interval);
  /// Its edges, valid until the next call; empty without a stimulus.
  const SharpEdges& edges(const protocols::Trial& trial, const protocols::Interval& interval);

 private:
  struct Place {
    const StimulusLibrary& library;
    int stimulus;  ///< in that library
  };
  Place find(const protocols::Trial& trial, const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  const StimulusLibrary* library_;
  protocols::Protocol one_;  ///< the protocol with one stimulus
  /// By block, stimulus and level; only the newest ones are kept.
  std::map<std::tuple<int, int, std::optional<double>>, std::unique_ptr<const StimulusLibrary>>
      known_;
};

/// The object at the interval's level, placed in the world: for drawing.
stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval);

/// The trials of a session of a protocol without blocks, with further rounds of practice until its
/// criterion is met. The members are named as those of protocols::TaskPlan.
class IdentificationPlan {
 public:
  /// \param protocol  must outlive it
  IdentificationPlan(const protocols::Protocol& protocol, int participant_number, int session);

  bool finished() const { return next_ == trials_.size(); }
  const protocols::Trial& next() const { return trials_[next_]; }  ///< \pre not finished()
  std::size_t done() const { return next_; }
  std::size_t size() const { return trials_.size(); }  ///< as far as known now
  std::size_t expected_size() const { return size(); }
  int last_block() const { return trials_.empty() ? 0 : trials_.back().block; }
  bool block_begins() const { return next_ == 0 || next().block != trials_[next_ - 1].block; }
  void answered(const protocols::TrialOutcome& outcome);

 private:
  void judge_practice();

  const protocols::Protocol* protocol_;
  int participant_number_;
  std::vector<protocols::Trial> trials_;
  std::size_t next_ = 0;
  int first_practice_block_ = 0;  ///< blocks before it are warm-up
  int round_ = 1;                 ///< of the practice under way
  int correct_ = 0, shown_ = 0;   ///< in that round
};

/// The trials of one session in order. Feeding it the recorded answers restores the point of an
/// interruption.
class SessionPlan {
 public:
  /// \param protocol  must outlive it
  SessionPlan(const protocols::Protocol& protocol, int participant_number, int session);

  bool finished() const {
    return std::visit([](const auto& plan) { return plan.finished(); }, plan_);
  }
  /// \pre not finished()
  const protocols::Trial& next() const {
    return std::visit(
        [](const auto& plan) -> const auto& { return plan.next(); }, plan_);
  }
  /// The block of tasks of the next trial; nullptr: it belongs to none, or the session is finished.
  const protocols::TaskBlock* next_block() const;
  std::size_t done() const {
    return std::visit([](const auto& plan) { return plan.done(); }, plan_);
  }
  /// As far as known now.
  std::size_t size() const {
    return std::visit([](const auto& plan) { return plan.size(); }, plan_);
  }
  /// The same, if adaptive blocks take their usual course rather than as many trials as they may.
  std::size_t expected_size() const {
    return std::visit([](const auto& plan) { return plan.expected_size(); }, plan_);
  }
  /// The number of its last block.
  int blocks() const {
    return std::visit([](const auto& plan) { return plan.last_block(); }, plan_);
  }
  /// True at the first trial of a block (of a session, for the first).
  bool block_begins() const {
    return std::visit([](const auto& plan) { return plan.block_begins(); }, plan_);
  }
  std::size_t done_in_block() const { return done_in_block_; }  ///< of the next trial
  /// Whether the trial before the next one was practice, of this session.
  bool after_practice() const { return after_practice_; }
  /// Sets another level for the next trial. \pre it belongs to an adaptive block
  void propose(double level) { std::get<protocols::TaskPlan>(plan_).propose(level); }
  /// An external program chooses the next trial. \pre it belongs to an external block
  void choose(const protocols::TrialChoice& choice) {
    std::get<protocols::TaskPlan>(plan_).choose(choice);
  }
  /// The next trial has been answered.
  void answered(const protocols::TrialOutcome& outcome);
  void answered(bool correct) { answered(protocols::TrialOutcome{correct, correct}); }

 private:
  using Plan = std::variant<IdentificationPlan, protocols::TaskPlan>;

  const protocols::Protocol* protocol_;
  Plan plan_;
  std::size_t done_in_block_ = 0;
  bool after_practice_ = false;
};

/// The outcome of a recorded trial, for SessionPlan::answered.
protocols::TrialOutcome outcome_of(const data::TrialRecord& record);

}  // namespace palpate::runner::session
