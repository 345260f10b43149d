#include "runner/servo/device.h"

namespace palpate::runner {

const char* advice(DeviceTrouble trouble) noexcept {
  switch (trouble) {
    case DeviceTrouble::none:
      return "";
    case DeviceTrouble::late:
      return "the device's reading came too late for a tick";
    case DeviceTrouble::unplugged:
      return "the device is unplugged: plug it in again";
    case DeviceTrouble::silent:
      return "the device gives no answer: check its cable and its power supply";
    case DeviceTrouble::not_homed:
      return "the device has lost its homing: pull the grip fully out, then push it straight in";
    case DeviceTrouble::implausible:
      return "the device reports positions that no hand could have moved to: home it again";
    case DeviceTrouble::apart:
      return "the two devices are not as far apart as the stylus is long: register them again";
    case DeviceTrouble::guarded:
      return "the guard process has sent zero force, since the servo was silent for too long or "
             "asked for it";
    case DeviceTrouble::guard_late:
      return "the guard process was late: the machine may be busy";
    case DeviceTrouble::guard_lost:
      return "the guard process has ended or hangs: start the program again";
    case DeviceTrouble::reopening:
      return "the device is being opened again";
  }
  return "";
}

}  // namespace palpate::runner
