#pragma once
// The outside view of a live session: the experimenter's console, and the markers for other
// recordings, both fed by the events of its trials.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "runner/participants/keyboard.h"
#include "runner/session/live_forces.h"
#include "runner/session/session.h"
#include "runner/session/session_hold.h"
#include "runner/session/signals.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

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

}  // namespace palpate::runner::session
