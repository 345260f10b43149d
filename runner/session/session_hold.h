#pragma once
// What keeps the next trial of a live session from beginning: the experimenter's pause, or a fault
// that took the forces off. After a fault forces come back only as the experimenter allows them.

#include <functional>
#include <string>

#include "runner/session/live_forces.h"
#include "runner/session/station.h"

namespace palpate::runner {

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

}  // namespace palpate::runner
