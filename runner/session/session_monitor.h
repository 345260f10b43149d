#pragma once
// What others see of a live session: the experimenter's console, and the markers that go to other
// recordings, both fed by the events of its trials.

#include <cstdint>
#include <string>

#include "runner/session/live_forces.h"
#include "runner/session/markers.h"
#include "runner/session/session.h"
#include "runner/session/station.h"

namespace palpate::runner {

/// Belongs to the session's thread.
class SessionMonitor final : public SessionEvents {
 public:
  /// What it looks at. All must outlive it.
  struct Sources {
    const Session& session;
    const KeyboardRespondent& respondent;
    const SessionHold& hold;
    LiveForces& forces;
    SessionNoise& noise;
  };
  SessionMonitor(const LiveStation& station, const Sources& sources);

  /// A message for the experimenter, shown at once.
  void say(const std::string& message);
  /// The console as of now.
  void show();
  /// As show(), but no more than 30 times a second.
  void show_if_due();

  /// From the beginning of a trial to its answer, or until it is cut off.
  bool in_trial() const { return in_trial_; }
  /// s, since the session began.
  double elapsed() const;
  /// A trial that is on record, for the accuracy so far.
  void count(const data::TrialRecord& record);
  /// "after this trial"; empty: no stop is asked for.
  void plan_stop(const std::string& when) { state_.stop_plan = when; }
  /// Nothing goes on, as `hold` says, until going_on().
  void held();
  void going_on() { state_.held_by.clear(); }

  void began(const protocols::Trial& trial) override;
  void onset(const data::TrialRecord& so_far) override;
  void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) override;
  void answered(const data::TrialRecord& record) override;
  void cut_off(const std::string& reason) override;
  void recorded(const data::TrialRecord& record) override;
  void interval(const protocols::Trial& trial, const IntervalView& view) override;
  void page(const PageView& view) override;
  void asking(bool now) override { asking_ = now; }
  /// The trial's intervals are over, a question of it is not.
  bool asking() const { return asking_; }

 private:
  std::string answer_in_words(const data::TrialRecord& record) const;

  const LiveStation& station_;
  const Sources sources_;
  ConsoleState state_;
  Marker marker_;  ///< of the trial under way, to be filled in
  std::int64_t started_ns_, trial_began_ns_ = 0, shown_ns_ = 0;  ///< session clock
  double seconds_per_trial_ = 0;                                 ///< mean, since the session began
  int timed_trials_ = 0;                                         ///< in that mean
  bool in_trial_ = false, feeling_ = false;
  bool began_feeling_ = false;  ///< the first interval of the trial has begun
  bool turned_ = false;         ///< the interval follows a turn: nothing new begins for others
  bool touched_ = false;        ///< in any interval of the trial
  bool asking_ = false;
  std::string page_;  ///< that is shown, as the state in words; empty: none
};

}  // namespace palpate::runner
