#pragma once
// A live session: the trial loop (Session) with a person at the device, and the experimenter's
// commands, pauses, faults and their clearing around it.

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "runner/participants/keyboard.h"
#include "runner/session/live_forces.h"
#include "runner/session/session.h"
#include "runner/session/session_hold.h"
#include "runner/session/session_monitor.h"
#include "runner/session/signals.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

class LiveSession final : public participants::Attendant {
 public:
  /// How the session ended.
  struct Outcome {
    data::RunEnd end = data::RunEnd::done;
    std::string reason;  ///< empty when done
    std::size_t recorded = 0, trials = 0;
    bool failed = false;  ///< ended by a signal or fault
  };

  /// \param station  must outlive it
  explicit LiveSession(const LiveStation& station);
  explicit LiveSession(LiveStation&& station) = delete;

  /// Runs until the session is completed or suspended; the run's end is on record, if it has begun.
  /// \throws StoreError: unacknowledged trials are not on record; forces are zero.
  Outcome run();

  /// For the session's own thread. \throws EndOfSession, TrialCutOff
  void attend() override;
  void sound(participants::SoundCue cue) override { sound_.cue(cue); }
  /// Shows a message to the experimenter.
  void say(const std::string& message) { monitor_.say(message); }
  /// Counts a recorded trial, for the accuracy so far.
  void count(const data::TrialRecord& record) { monitor_.count(record); }

 private:
  Outcome run_trials();
  void before_step();
  void stop_if_due();  ///< only between trials. \throws EndOfSession
  void wait_while_held();
  void obey(const display::ConsoleCommand& command);
  void plan_stop(display::ConsoleCommand::Kind kind);
  void correct(const display::ConsoleCommand& command);
  void take_last_commands(Outcome& outcome);
  void check_sound();
  void check_screen();
  void check_device();
  void note(std::int64_t at_ns, const std::string& text);

  const LiveStation& station_;
  LiveForces forces_;
  SessionHold hold_;
  SessionSound sound_;
  TrialSignals signals_;
  SessionMonitor monitor_;
  participants::KeyboardRespondent respondent_;
  Session session_;
  std::deque<display::ConsoleCommand> commands_;  ///< not obeyed yet
  std::string misplaced_;                         ///< the participant's window, as told last
  std::string shown_trouble_;                     ///< of the participant's inputs, as shown last
  enum class Stop { no, after_trial, after_block } stop_ = Stop::no;
};

}  // namespace palpate::runner::session
