#pragma once
// A session as a state machine, the same for simulated and live participants.

#include <functional>
#include <stdexcept>

#include "data/record.h"
#include "runner/participants/respondent.h"
#include "runner/scene_builder.h"
#include "runner/session_plan.h"
#include "runner/tick_source.h"
#include "runner/trial_log.h"

namespace palpate {

/// What was in front of the participant was no trial any more: lost device, forces tripped. The
/// attempt is on record as cut off, the forces are zero.
class SessionFault : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Session {
 public:
  enum class State {
    instruction,  ///< what this is about; also after an interruption
    practice,     ///< a block that is not analysed begins
    block,        ///< a block begins
    rest,         ///< a break is due
    trial,        ///< from the home zone to the answer
    response,     ///< on record, feedback
    end,
  };

  /// All of it must outlive the session.
  struct Parts {
    const Protocol& protocol;
    const StimulusLibrary& library;
    TickSource& servo;
    Clock& clock;
    Respondent& participant;
    TrialLog& log;
  };

  /// \param plan  already fed with what is on record
  /// \param stamp  ties the clock to the calendar
  Session(const Parts& parts, SessionPlan plan, const ClockStamp& stamp);

  State state() const { return state_; }
  const SessionPlan& plan() const { return plan_; }
  /// Does what the state asks for and moves on. Between any two calls everything that happened is
  /// on record. \throws SessionFault; StoreError when a record could not be written (forces are
  /// zero).
  void step();

 private:
  State before_trial() const;
  TrialRecord planned_record(const Trial& trial) const;
  void run_trial();
  void note(const Sample& sample);
  void keep(const Sample& sample);  ///< among the record's samples

  Parts parts_;
  SessionPlan plan_;
  ClockStamp stamp_;
  State state_ = State::instruction;
  TrialRecord record_;  ///< of the trial under way
};

}  // namespace palpate
