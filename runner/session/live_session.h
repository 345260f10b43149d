#pragma once
// A session with a person: the experimenter's commands, pauses, faults and their clearing, and what
// is shown of it, around the same Session that simulated participants go through.

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "runner/participants/keyboard.h"
#include "runner/safety/guarded_device.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/live_forces.h"
#include "runner/session/markers.h"
#include "runner/session/run_record.h"
#include "runner/session/session.h"
#include "runner/session/session_end.h"
#include "runner/sound/masking_noise.h"

namespace palpate::runner {

class LiveSession final : public Attendant, private SessionEvents {
 public:
  /// All must outlive it.
  struct Parts {
    const protocols::Protocol& protocol;
    const StimulusLibrary& library;
    ServoThread& servo;
    GuardedDevice* guard;  ///< may be none
    Clock& clock;
    RunRecord& record;
    ParticipantScreen& screen;
    ExperimenterConsole& console;
    Markers& markers;
    AnswerBy answer_by;
    std::function<int()> end_requested;  ///< the signal that asked for the end; 0: none
    NoisePlayer* noise = nullptr;        ///< may be none
  };

  /// What became of it.
  struct Outcome {
    data::RunEnd end = data::RunEnd::done;
    std::string reason;  ///< empty when done
    std::size_t recorded = 0, trials = 0;
    bool failed = false;                ///< a signal or a fault, not somebody's wish, was the end
    std::vector<std::string> unkept{};  ///< the experimenter's notes, where no run was begun
  };

  LiveSession(const Parts& parts, const data::ClockStamp& stamp, const SessionPlan& plan);

  /// Until the session is over, for good or for today; the run's end is on record, if it has begun.
  /// \throws StoreError: what was not acknowledged is not on record; forces are zero.
  Outcome run();

  /// For the session's own thread. \throws EndOfSession, TrialCutOff
  void attend() override;
  void say(const std::string& message);
  /// A trial that is on record, for the accuracy so far.
  void count(const data::TrialRecord& record);

 private:
  Outcome go_through();
  void between_trials();
  void stop_if_due();  ///< where no trial is under way. \throws EndOfSession
  void wait_while_held();
  void obey(const ConsoleCommand& command);
  void plan_stop(ConsoleCommand::Kind kind);
  void take_last_words(Outcome& outcome);
  /// Forces are off and nothing goes on until the experimenter says so.
  void hold(const std::string& reason, bool passed, DeviceTrouble trouble);
  bool allow_forces();  ///< false: something stands against it, and is said
  void clear_fault(std::int64_t at_ns);
  void pause();
  void go_on();
  void end_with_the_guard() const;  ///< \throws EndOfSession where it has ended
  std::string ways_on() const;      ///< what to press or type
  bool start_noise();               ///< false: it cannot be had, and the session is paused
  void stop_noise();
  void watch_noise();
  void watch_device();
  void note(std::int64_t at_ns, const std::string& text);
  void show_console();

  void began(const protocols::Trial& trial) override;
  void onset(const data::TrialRecord& so_far) override;
  void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) override;
  void answered(const data::TrialRecord& record) override;
  void cut_off(const std::string& reason) override;
  void recorded(const data::TrialRecord& record) override;

  Parts parts_;
  KeyboardRespondent respondent_;
  Session session_;
  LiveForces forces_;
  ConsoleState state_;
  std::deque<ConsoleCommand> commands_;  ///< not obeyed yet
  Marker marker_;                        ///< of the trial under way, to be filled in
  std::int64_t started_ns_, began_ns_ = 0, shown_ns_ = 0;
  double seconds_per_trial_ = 0;  ///< mean, of this run
  int timed_trials_ = 0;
  bool noise_noted_ = false;  ///< its start is on record, its end is not
  bool in_trial_ = false, feeling_ = false;
  /// What keeps the next trial from beginning; each says more than the one before.
  enum class Hold {
    none,
    pause,
    passed,  ///< forces are off, but what took them off is over: to go on is enough
    fault,   ///< forces are off: the fault must be cleared first
  } hold_ = Hold::none;
  std::string held_state_, held_reason_;  ///< of Hold::passed and fault
  std::string zero_asked_by_;             ///< " by the key F12"
  enum class Stop { no, after_trial, after_block } stop_ = Stop::no;
};

}  // namespace palpate::runner
