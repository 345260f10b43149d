#pragma once
// A hold prevents the next trial of a live session: the experimenter's pause, or a fault that
// turned the forces off. After a fault, forces return only when the experimenter allows them.

#include <functional>
#include <string>
#include <utility>

#include "runner/session/live_forces.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

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
  void resume();
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

}  // namespace palpate::runner::session
