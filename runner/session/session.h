#pragma once
// The trial loop: a session as a state machine, the same for simulated and live participants. Also
// its holds (pauses and faults) and its events.

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/record.h"
#include "runner/participants/respondent.h"
#include "runner/session/live_forces.h"
#include "runner/session/session_plan.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

// The end of a session before its last trial.

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(data::RunEnd how, const std::string& why, bool by_fault = false)
      : std::runtime_error(why), end(how), failed(by_fault) {}
  data::RunEnd end;
  bool failed;  ///< ended by a signal or fault
};

/// How the session ends after ":quit WORDS" from the experimenter. Any form of "withdraw" among the
/// words, in upper or lower case, records a withdrawal.
EndOfSession end_by_experimenter(const std::string& words);

// A hold prevents the next trial of a live session: the experimenter's pause, or a fault that
// turned the forces off. After a fault, forces return only when the experimenter allows them.

/// Belongs to the session's thread.
class SessionHold {
 public:
  /// In order of severity.
  enum class Kind {
    none,
    pause,
    transient_fault,  ///< forces are off, but the cause is over: resuming clears it
    fault,            ///< forces are off: clear it before resuming
  };

  /// \param say  takes messages for the experimenter. All must outlive it.
  SessionHold(const LiveStation& station, LiveForces& forces,
              std::function<void(const std::string&)> say)
      : station_(station), forces_(forces), say_(std::move(say)) {}

  Kind kind() const { return kind_; }
  /// The reason that forces are off; empty: they are on, or the fault has not been noticed.
  const std::string& fault() const { return fault_; }
  /// For the console: "paused" or "fault".
  std::string state() const { return kind_ == Kind::pause ? "paused" : fault_state_; }
  /// For the console: the reason, and the button or command to resume.
  std::string held_by() const;
  /// The button or command to resume.
  std::string how_to_continue() const;

  /// \param reason  shown until the experimenter resumes; empty: the experimenter asked for it
  void pause(const std::string& reason = {});
  /// Turns forces off and holds the session until the experimenter resumes it.
  /// \param transient  whether the cause ends by itself
  void hold(const std::string& reason, bool transient, servo::DeviceTrouble trouble);
  /// Zero force at once, on request. \param by  source of the request: "the key F12"
  /// \param in_trial  first cuts off the current trial; else holds the session now
  void emergency_zero(const std::string& by, bool in_trial);
  /// The experimenter reports the cause removed. True: forces are allowed again and the session is
  /// paused; false: forces stay off, or there is no fault. Reports either.
  bool clear_fault();
  void go_on();
  /// Call when the session resumes: the next hold has its own reason.
  void forget_reason() { reason_.clear(); }

 private:
  bool allow_forces();  ///< false: forces stay off; the reason is reported

  const LiveStation& station_;
  LiveForces& forces_;
  std::function<void(const std::string&)> say_;
  Kind kind_ = Kind::none;
  std::string fault_;
  std::string fault_state_, reason_;  ///< of the last fault
  std::string zero_asked_by_;         ///< " by the key F12"
};

/// A trial could not continue: the device was lost or forces went off. The attempt is recorded as
/// cut off, forces are zero.
class SessionFault : public std::runtime_error {
 public:
  SessionFault(const std::string& what, std::string why, std::uint32_t bits,
               servo::DeviceTrouble device)
      : std::runtime_error(what), reason(std::move(why)), faults(bits), trouble(device) {}
  /// Whether the fault ends by itself: the machine was late, device and stylus are well.
  bool is_transient() const;
  std::string reason;    ///< of the forces going off
  std::uint32_t faults;  ///< of the tick
  servo::DeviceTrouble trouble;
};

/// The reason that forces went off, in words. \param faults, trouble  of a sample with kTripped
std::string trip_reason(std::uint32_t faults, servo::DeviceTrouble trouble);

/// The visible part of a page.
struct PageView {
  std::string page, question;  ///< names; for a consent the question is "consent"
  int number = 0, questions = 0;
};

/// The events of a trial, as they happen: for markers and the experimenter's console.
class SessionEvents {
 public:
  virtual ~SessionEvents() = default;
  virtual void began(const protocols::Trial& trial) = 0;
  /// Time zero.
  virtual void onset(const data::TrialRecord& so_far) = 0;
  /// \param time_ns  session clock
  virtual void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) = 0;
  virtual void answered(
      const data::TrialRecord& record) = 0;  ///< not on record yet; also a time-out
  virtual void cut_off(const std::string& reason) = 0;
  virtual void recorded(const data::TrialRecord& record) = 0;
  /// An interval of the trial, which belongs to a block, is about to begin.
  virtual void interval(const protocols::Trial& /*trial*/,
                        const participants::IntervalView& /*view*/) {}
  /// A page is shown, or one of its questions: its number, from 1, and their count; 0:
  /// the text. Empty names: the page is over.
  virtual void page(const PageView& /*view*/) {}
  /// The trial is answered, and confidence will be asked. A kill would lose the answer otherwise.
  virtual void unrated(const data::TrialRecord& /*so_far*/) {}
  /// The question for confidence begins (forces off) or ends.
  virtual void asking(bool /*now*/) {}
};

class Session {
 public:
  enum class State {
    instruction,  ///< introduces the session; also after an interruption
    practice,     ///< a block that is not analysed begins
    block,        ///< a block begins
    rest,         ///< a break is due
    trial,        ///< from the home zone to the answer
    response,     ///< on record, feedback
    end,
  };

  /// \param station      its parts must outlive the session
  /// \param events       may be none
  /// \param least_reach  m; least radius of the home zone, for every stimulus. The place where the
  /// screen stops asking to move away must not reveal a shape.
  Session(const Station& station, participants::Respondent& participant,
          SessionEvents* events = nullptr, double least_reach = 0);

  State state() const { return state_; }
  const SessionPlan& plan() const { return station_.plan; }
  /// What a trial asks.
  const protocols::TaskBlock& task_of(const protocols::Trial& trial) const;
  /// Whether a page after the last trial still needs answers.
  bool has_open_pages() const;
  /// Does the work of the current state and moves on. Between two calls every event is on record:
  /// after any exception in a trial, forces are zero, the attempt is cut off, and the next call
  /// shows the trial again. \throws SessionFault; StoreError when a record could not be written;
  /// exceptions of the participant, except TrialCutOff.
  void step();

 private:
  State before_trial() const;
  data::TrialRecord planned_record(const protocols::Trial& trial) const;
  bool run_trial();  ///< false: the trial was cut off
  /// The servo's last values in a trial.
  struct ServoState {
    std::uint32_t faults = 0;
    servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
    bool tripped() const;
  };
  void plan_task(const protocols::Trial& trial, data::TrialRecord& record) const;
  std::optional<participants::Answer> show_intervals(const protocols::Trial& trial,
                                                     ServoState& servo);
  std::optional<participants::Answer> adjust(const protocols::Trial& trial, ServoState& servo);
  std::optional<participants::Answer> ask_without_forces(const protocols::Trial& trial,
                                                         ServoState& servo);
  void prepare_interval(const protocols::Trial& trial, const protocols::Interval& interval,
                        const servo::HomeZone& home);
  servo::HomeZone home_of(const protocols::Interval& interval, double rest) const;
  std::optional<participants::Answer> wait_in_interval(const participants::IntervalView& view,
                                                       std::optional<double> limit,
                                                       ServoState& servo);
  void end_interval();
  void tell_interval(const protocols::Trial& trial, const participants::IntervalView& view);
  void judge(const protocols::Trial& trial, const participants::Answer& answer);
  void ask_confidence(const protocols::ConfidenceSpec& asked);
  void begin_task_block();
  void ask_level();
  void tell_level();
  void read_instructions(const protocols::TaskBlock& block);
  void resume_task_block();
  void show_pages(protocols::PageSpec::When when, const std::string& block = "");
  void show_page(const protocols::PageSpec& page);
  void store_answer(const protocols::PageSpec& page, const protocols::PageItem& item,
                    const std::string& answer);
  void tell_page(const PageView& view);
  void cut_off(const std::string& reason);
  void rest_between_blocks();
  void rest();
  void tell_feedback();
  void add_quality(const servo::ServoQuality& quality);
  void take_answer(const protocols::Trial& trial,
                   const std::optional<participants::Answer>& answer);
  void record_onset_and_contact(const servo::Sample& sample);
  void record_sample(const servo::Sample& sample);

  Station station_;  ///< with the session's own plan
  participants::Respondent& participant_;
  SessionEvents* events_;
  double least_reach_;
  State state_ = State::instruction;
  data::TrialRecord record_;             ///< of the trial under way
  ContactLog contact_;                   ///< likewise
  servo::ServoQuality quality_;          ///< likewise, of its intervals so far
  protocols::TaskBlock identification_;  ///< of each trial without a block
  SessionScenes scenes_;
  int asked_trial_ = 0;  ///< the last trial for which an advisor was asked
};

}  // namespace palpate::runner::session
