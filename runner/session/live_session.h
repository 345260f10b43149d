#pragma once
// A live session: the trial loop (Session) with a person at the device, and the experimenter's
// commands, pauses, faults and their clearing around it.

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "runner/participants/keyboard.h"
#include "runner/session/live_forces.h"
#include "runner/session/recorders.h"
#include "runner/session/session.h"
#include "runner/session/signals.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

// The outside view of a live session: the experimenter's console, and the markers for other
// recordings, both fed by the events of its trials.

/// Shows a session's events on the console and sends them as markers. Belongs to the session's
/// thread.
class SessionMonitor final : public SessionEvents {
 public:
  /// Its inputs and outputs. All must outlive it.
  struct Sources {
    const Session& session;
    const participants::KeyboardRespondent& respondent;
    const SessionHold& hold;
    LiveForces& forces;
    TrialSignals& signals;
  };
  SessionMonitor(const LiveStation& station, const Sources& sources);

  /// Shows a message to the experimenter at once.
  void say(const std::string& message);
  /// Updates the console.
  void show();
  /// Updates the console, at most 30 times a second.
  void show_if_due();

  /// True from the beginning of a trial until its answer or cut-off.
  bool in_trial() const { return in_trial_; }
  /// s, since the session began.
  double elapsed() const;
  /// Trials of the session, if adaptive blocks take their usual course.
  std::size_t expected_trials();
  /// Counts a recorded trial, for the accuracy so far.
  void count(const data::TrialRecord& record);
  /// "after this trial"; empty: no stop is planned.
  void plan_stop(const std::string& when) { state_.stop_plan = when; }
  /// Shows the answers to pages that the experimenter may correct.
  void show_answers();
  /// The session is held, as `hold` says, until going_on().
  void held();
  void going_on() { state_.held_by.clear(); }

  void began(const protocols::Trial& trial) override;
  void onset(const data::TrialRecord& so_far) override;
  void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) override;
  void answered(const data::TrialRecord& record) override;
  void cut_off(const std::string& reason) override;
  void recorded(const data::TrialRecord& record) override;
  void interval(const protocols::Trial& trial, const participants::IntervalView& view) override;
  void page(const PageView& view) override;
  void unrated(const data::TrialRecord& so_far) override;
  void asking(bool now) override { asking_ = now; }
  /// Whether the trial's intervals are over but a question of it is still open.
  bool asking() const { return asking_; }

 private:
  std::string answer_in_words(const data::TrialRecord& record) const;

  const LiveStation& station_;
  const Sources sources_;
  display::ConsoleState state_;
  std::int64_t started_ns_, trial_began_ns_ = 0, shown_ns_ = 0;  ///< session clock
  double seconds_per_trial_ = 0;                                 ///< mean, since the session began
  std::optional<std::size_t> expected_at_;  ///< the trials done when they were expected last
  std::size_t expected_ = 0;
  int timed_trials_ = 0;  ///< in that mean
  bool in_trial_ = false, feeling_ = false;
  bool touched_ = false;  ///< in any interval of the trial
  bool asking_ = false;
  std::string page_;  ///< on show, as the state in words; empty: none
};

class LiveSession final : public participants::Attendant {
 public:
  /// How the session ended.
  struct Outcome {
    data::RunEnd end = data::RunEnd::done;
    std::string reason;  ///< empty when done
    std::size_t recorded = 0, trials = 0;
    bool failed = false;                ///< ended by a signal or fault
    std::vector<std::string> unkept{};  ///< the experimenter's notes, if no run was begun
  };

  /// \param station  must outlive it
  explicit LiveSession(const LiveStation& station);
  explicit LiveSession(LiveStation&& station) = delete;

  /// Runs until the session is completed or suspended; the run's end is on record, if it has begun.
  /// \throws StoreError: unacknowledged trials are not on record; forces are zero.
  Outcome run();

  /// For the session's own thread. \throws EndOfSession, TrialCutOff
  void attend() override;
  void sound(participants::SoundCue cue) override { noise_.cue(cue); }
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
  void check_noise();
  void check_screen();
  void check_device();
  void note(std::int64_t at_ns, const std::string& text);

  const LiveStation& station_;
  LiveForces forces_;
  SessionHold hold_;
  SessionNoise noise_;
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
