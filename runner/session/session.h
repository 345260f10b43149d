#pragma once
// The trial loop: a session as a state machine, the same for simulated and live participants.

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

namespace palpate::runner {

// Why and how a live session ends before its last trial.

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(data::RunEnd how, const std::string& why, bool by_fault = false)
      : std::runtime_error(why), end(how), failed(by_fault) {}
  data::RunEnd end;
  bool failed;  ///< ended by a signal or fault
};

/// What the experimenter's "quit" with these words means. Any form of "withdraw" among them, in
/// upper or lower case, records a withdrawal.
EndOfSession end_by_experimenter(const std::string& words);

// What keeps the next trial of a live session from beginning: the experimenter's pause, or a fault
// that took the forces off. After a fault forces come back only as the experimenter allows them.

/// Belongs to the session's thread.
class SessionHold {
 public:
  /// Each says more than the one before.
  enum class Kind {
    none,
    pause,
    transient_fault,  ///< forces are off, but what took them off is over: going on clears it
    fault,            ///< forces are off: it must be cleared before the session can go on
  };

  /// \param say  takes messages for the experimenter. All must outlive it.
  SessionHold(const LiveStation& station, LiveForces& forces,
              std::function<void(const std::string&)> say)
      : station_(station), forces_(forces), say_(std::move(say)) {}

  Kind kind() const { return kind_; }
  /// Why forces are off; empty: they are not, or not by a fault that has been noticed.
  const std::string& fault() const { return fault_; }
  /// For the console: "paused" or "fault".
  std::string state() const { return kind_ == Kind::pause ? "paused" : fault_state_; }
  /// For the console: the reason, and what to press or type to go on.
  std::string held_by() const;
  /// What to press or type to go on.
  std::string how_to_continue() const;

  void pause();
  /// Forces are off and nothing goes on until the experimenter says so.
  /// \param transient  what took them off is over by itself
  void hold(const std::string& reason, bool transient, DeviceTrouble trouble);
  /// Zero force at once, as somebody asked. \param by  what asked for it: "the key F12"
  /// \param in_trial  the trial under way is cut off first; else nothing goes on from now
  void emergency_zero(const std::string& by, bool in_trial);
  /// The experimenter says that the cause is removed. True: forces are allowed again and the
  /// session is paused; false: forces stay off, or there is no fault; either is said.
  bool clear_fault();
  void go_on();
  /// The session goes on: the reason was another time's.
  void forget_reason() { reason_.clear(); }

 private:
  bool allow_forces();  ///< false: forces stay off; why is said

  const LiveStation& station_;
  LiveForces& forces_;
  std::function<void(const std::string&)> say_;
  Kind kind_ = Kind::none;
  std::string fault_;
  std::string fault_state_, reason_;  ///< of the last fault
  std::string zero_asked_by_;         ///< " by the key F12"
};

// Masking noise in a live session: it sounds while trials are run, and what was heard goes on
// record.

/// Belongs to the session's thread. Does nothing where the station has no noise.
class SessionNoise {
 public:
  /// \param say  takes messages for the experimenter. The station must outlive it.
  SessionNoise(const LiveStation& station, std::function<void(const std::string&)> say)
      : station_(station), say_(std::move(say)) {}

  /// On, if it is not. False: the sound output cannot be opened, which is said.
  bool start();
  /// Off, if it is on.
  void stop();
  /// True where the output has failed since start(), as when headphones are pulled out: it is said,
  /// and the noise is off.
  bool has_failed();
  /// "Go": forces are on.
  void go_tone();
  /// Of the protocol's sounds, where it has this one.
  void cue(SoundCue cue);

 private:
  const LiveStation& station_;
  std::function<void(const std::string&)> say_;
  bool on_record_ = false;  ///< its start is on record, its end is not
};

/// A trial could not go on: the device was lost or forces went off. The attempt is on record as cut
/// off, forces are zero.
class SessionFault : public std::runtime_error {
 public:
  SessionFault(const std::string& what, std::string why, std::uint32_t bits, DeviceTrouble device)
      : std::runtime_error(what), reason(std::move(why)), faults(bits), trouble(device) {}
  /// It is over by itself: the machine was late, nothing is wrong with device or stylus.
  bool is_transient() const;
  std::string reason;    ///< why forces are off
  std::uint32_t faults;  ///< of the tick
  DeviceTrouble trouble;
};

/// Why forces went off, in words. \param faults, trouble  of a sample with kTripped
std::string trip_reason(std::uint32_t faults, DeviceTrouble trouble);

/// What is shown of a page.
struct PageView {
  std::string page, question;  ///< names; of a consent the question is "consent"
  int number = 0, questions = 0;
};

/// What happens in a trial, as it happens: for markers and the experimenter's console.
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
  /// Version 2: an interval of the trial is about to begin.
  virtual void interval(const protocols::Trial& /*trial*/, const IntervalView& /*view*/) {}
  /// Version 2: a page is shown, or a question of it: its number, from 1, of so many; 0: the text.
  /// Empty names: the page is over.
  virtual void page(const PageView& /*view*/) {}
  /// Version 2: how sure the participant is, is asked, with forces off, or no longer.
  virtual void asking(bool /*now*/) {}
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

  /// \param station      its parts must outlive the session
  /// \param events       may be none
  /// \param least_reach  m; the home zone leaves at least so much room, whichever the stimulus. A
  /// person whom the screen tells to move away must not learn a shape from where that ends.
  Session(const Station& station, Respondent& participant, SessionEvents* events = nullptr,
          double least_reach = 0);

  State state() const { return state_; }
  const SessionPlan& plan() const { return station_.plan; }
  /// Whether a page after the last trial waits for answers.
  bool has_open_pages() const;
  /// Does what the state asks for and moves on. Between any two calls everything that happened is
  /// on record: whatever is thrown in a trial, forces are zero, the attempt is cut off, and the
  /// next call shows the trial again. \throws SessionFault; StoreError when a record could not be
  /// written; what the participant throws, but TrialCutOff.
  void step();

 private:
  State before_trial() const;
  data::TrialRecord planned_record(const protocols::Trial& trial) const;
  bool run_trial();  ///< false: it was cut off
  /// What the servo said last in a trial.
  struct ServoState {
    std::uint32_t faults = 0;
    DeviceTrouble trouble = DeviceTrouble::none;
    bool tripped() const;
  };
  std::optional<Answer> show_stimulus(const protocols::Trial& trial, ServoState& servo);
  std::optional<Answer> wait_for_answer(ServoState& servo);
  // Version 2 (session.cpp)
  void plan_task(const protocols::Trial& trial, data::TrialRecord& record) const;
  std::optional<Answer> show_intervals(const protocols::Trial& trial, ServoState& servo);
  std::optional<Answer> adjust(const protocols::Trial& trial, ServoState& servo);
  std::optional<Answer> ask_without_forces(const protocols::Trial& trial, ServoState& servo);
  void prepare_interval(const protocols::Trial& trial, const protocols::Interval& interval,
                        const HomeZone& home);
  HomeZone task_home(double rest) const;
  std::optional<Answer> wait_in_interval(const IntervalView& view, std::optional<double> limit,
                                         ServoState& servo);
  void end_interval();
  void tell_interval(const protocols::Trial& trial, const IntervalView& view);
  void take_task_answer(const protocols::Trial& trial, const std::optional<Answer>& answer);
  void ask_confidence(const protocols::ConfidenceSpec& asked);
  void begin_task_block();
  void ask_level();
  void tell_level();
  void read_instructions(const protocols::TaskBlock& block);
  void resume_task_block();
  void show_pages(protocols::PageSpec::When when, const std::string& block = "");
  void show_page(const protocols::PageSpec& page);
  void tell_page(const PageView& view);
  const protocols::TaskBlock& task_of(const protocols::Trial& trial) const;
  void cut_off(const std::string& reason);
  void rest_between_blocks();
  void rest();
  void tell_feedback();
  void add_quality(const ServoQuality& quality);
  void take_answer(const protocols::Trial& trial, const std::optional<Answer>& answer);
  void record_onset_and_contact(const Sample& sample);
  void record_sample(const Sample& sample);

  Station station_;  ///< with the session's own plan
  Respondent& participant_;
  SessionEvents* events_;
  double least_reach_;
  State state_ = State::instruction;
  data::TrialRecord record_;             ///< of the trial under way
  ContactLog contact_;                   ///< likewise
  ServoQuality quality_;                 ///< likewise, of its intervals so far
  std::unique_ptr<LevelScenes> scenes_;  ///< version 2
  int asked_trial_ = 0;                  ///< the last one whose level an advisor was asked for
};

}  // namespace palpate::runner
