#pragma once
// A session with a person: the experimenter's commands, pauses, faults and their clearing, and what
// is shown of it, around the same Session that simulated participants go through.

#include <cstdint>
#include <deque>
#include <functional>
#include <stdexcept>
#include <string>

#include "runner/guard.h"
#include "runner/markers.h"
#include "runner/participants/keyboard.h"
#include "runner/servo_thread.h"
#include "runner/session.h"
#include "runner/sound/masking_noise.h"

namespace palpate {

/// The end of a session before its last trial; what() says why, for the record.
class EndOfSession : public std::runtime_error {
 public:
  EndOfSession(RunEnd how, const std::string& why, bool unwanted = false)
      : std::runtime_error(why), end(how), failed(unwanted) {}
  RunEnd end;
  bool failed;  ///< nobody wished it
};

class LiveSession final : public Attendant, private SessionEvents {
 public:
  /// All must outlive it.
  struct Parts {
    const Protocol& protocol;
    const StimulusLibrary& library;
    ServoThread& servo;
    GuardedDevice* guard;  ///< may be none
    Clock& clock;
    Store& store;
    ParticipantScreen& screen;
    ExperimenterConsole& console;
    Markers& markers;
    AnswerBy answer_by;
    std::function<int()> end_requested;  ///< the signal that asked for the end; 0: none
    NoisePlayer* noise = nullptr;        ///< may be none
  };

  /// What became of it.
  struct Outcome {
    RunEnd end = RunEnd::done;
    std::string reason;  ///< empty when done
    std::size_t recorded = 0, trials = 0;
    bool failed = false;  ///< a signal or a fault, not somebody's wish, was the end
  };

  LiveSession(const Parts& parts, const Participant& participant, const Run& run,
              const ClockStamp& stamp, const SessionPlan& plan);

  /// Until the session is over, for good or for today; the run's end is on record.
  /// \throws StoreError: what was not acknowledged is not on record; forces are zero.
  Outcome run();

  /// For the session's own thread. \throws EndOfSession, TrialCutOff
  void attend() override;
  void say(const std::string& message);

 private:
  Outcome go_through();
  void between_trials();
  void stop_if_due();  ///< where no trial is under way. \throws EndOfSession
  void wait_while_held();
  void obey(const ConsoleCommand& command);
  void zero_force();
  bool start_noise();  ///< false: it cannot be had, and the session is paused
  void stop_noise();
  void watch_noise();
  void note(std::int64_t at_ns, const std::string& text);
  void show_console();

  void began(const Trial& trial) override;
  void onset(const TrialRecord& so_far) override;
  void first_contact(const TrialRecord& so_far, std::int64_t time_ns) override;
  void answered(const TrialRecord& record) override;
  void cut_off(const std::string& reason) override;
  void recorded(const TrialRecord& record) override;

  Parts parts_;
  Run run_;
  KeyboardRespondent respondent_;
  DurableLog log_;
  Session session_;
  ConsoleState state_;
  std::deque<ConsoleCommand> commands_;  ///< not obeyed yet
  Marker marker_;                        ///< of the trial under way, to be filled in
  std::int64_t started_ns_, began_ns_ = 0, shown_ns_ = 0;
  double seconds_per_trial_ = 0;  ///< mean, of this run
  int timed_trials_ = 0;
  bool noise_noted_ = false;  ///< its start is on record, its end is not
  bool in_trial_ = false, feeling_ = false, paused_ = false, faulted_ = false;
  enum class Stop { no, after_trial, after_block } stop_ = Stop::no;
};

}  // namespace palpate
