#include "runner/servo/device.h"

namespace palpate::runner::servo {

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
    case DeviceTrouble::not_calibrated:
      return "the device asks for its maker's calibration: put the grip into its calibration pit, "
             "or calibrate it as its manual says";
    case DeviceTrouble::stopped_by_device:
      return "the device has taken its forces off by itself: it was moved too fast, is too warm, "
             "or had no command for too long";
    case DeviceTrouble::service_gone:
      return "the maker's service through which the device is reached has ended: start it again";
    case DeviceTrouble::in_use:
      return "another program commands the device: end that program";
    case DeviceTrouble::unreadable:
      return "the maker's service sends messages that cannot be read: restart it, or install a "
             "version that palpate knows";
  }
  return "";
}

bool needs_reopening(DeviceTrouble trouble) noexcept {
  return trouble == DeviceTrouble::unplugged || trouble == DeviceTrouble::silent ||
         trouble == DeviceTrouble::stopped_by_device || trouble == DeviceTrouble::service_gone ||
         trouble == DeviceTrouble::in_use || trouble == DeviceTrouble::unreadable;
}

}  // namespace palpate::runner::servo
