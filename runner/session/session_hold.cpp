#include "runner/session/session_hold.h"

#include <algorithm>

#include "runner/session/session_end.h"

namespace palpate::runner::session {
namespace {

std::string emergency_reason() {
  return trip_reason(servo::servo_fault::kEmergency, servo::DeviceTrouble::none);
}

}  // namespace

void SessionHold::pause(const std::string& reason) {
  kind_ = std::max(kind_, Kind::pause);
  if (kind_ == Kind::pause && !reason.empty()) reason_ = reason;
}

void SessionHold::hold(const std::string& reason, bool transient, servo::DeviceTrouble trouble) {
  kind_ = transient ? Kind::transient_fault : Kind::fault;
  fault_state_ = trouble == servo::DeviceTrouble::guard_late ? "paused" : "fault";
  reason_ = reason + (reason == emergency_reason() ? zero_asked_by_ : "");
  fault_ = reason_;
}

void SessionHold::emergency_zero(const std::string& by, bool in_trial) {
  forces_.off();
  zero_asked_by_ = " by " + by;
  fault_ = emergency_reason() + zero_asked_by_;
  if (!in_trial) hold(emergency_reason(), false, servo::DeviceTrouble::none);
}

std::string SessionHold::how_to_continue() const {
  const std::string go = station_.console.name_of(display::ConsoleCommand::Kind::resume);
  if (kind_ != Kind::fault) return "to continue: " + go;
  return "to continue: " + station_.console.name_of(display::ConsoleCommand::Kind::clear_fault) +
         ", then " + go;
}

std::string SessionHold::held_by() const {
  return reason_ + (reason_.empty() ? "" : "; ") + how_to_continue();
}

bool SessionHold::allow_forces() {
  const servo::DeviceTrouble before = forces_.newest().trouble;
  if (station_.guard != nullptr &&
      (before == servo::DeviceTrouble::unplugged || before == servo::DeviceTrouble::silent))
    say_("reopening the device");
  const std::string trouble = forces_.allow([this] { return station_.end_requested() != 0; });
  const servo::DeviceTrouble now = forces_.newest().trouble;
  forces_.end_without_guard();
  if (trouble.empty()) {
    fault_.clear();
    return true;
  }
  hold(trouble, false, now);
  say_("not cleared, forces stay off: " + trouble + "; after that, " + how_to_continue());
  return false;
}

bool SessionHold::clear_fault() {
  if (kind_ < Kind::transient_fault) {
    say_("there is no fault to clear");
    return false;
  }
  if (!allow_forces()) return false;
  kind_ = Kind::pause;
  reason_.clear();
  return true;
}

void SessionHold::resume() {
  if (kind_ == Kind::none) {
    say_("nothing is paused");
  } else if (kind_ == Kind::fault) {
    say_("forces are off: clear the fault first (" +
         station_.console.name_of(display::ConsoleCommand::Kind::clear_fault) + ")");
  } else if (kind_ == Kind::pause || allow_forces()) {
    kind_ = Kind::none;
    say_("going on");
  }
}

}  // namespace palpate::runner::session
