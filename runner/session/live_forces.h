#pragma once
// Switches the forces of a live session: off at once, on again only where device and watchdog work.

#include <functional>
#include <string>

#include "runner/safety/guarded_device.h"
#include "runner/servo/servo_thread.h"

namespace palpate::runner {

/// Belongs to the session's thread: it takes the servo's newest samples.
class LiveForces {
 public:
  /// \param guard  may be none. All must outlive it.
  LiveForces(ServoThread& servo, GuardedDevice* guard, Clock& clock)
      : servo_(servo), guard_(guard), clock_(clock) {}

  /// Zero force at once, until allow().
  void off() noexcept;
  /// Likewise by the servo's ramp. From any thread.
  void fade() noexcept { servo_.fade_out(); }
  /// Allows forces again, once the device has given a good reading. One that is unplugged or silent
  /// is opened again first, which may take seconds.
  /// \param stop  asked every few milliseconds: true gives it up
  /// \return why forces stay off, in words; empty: they are allowed
  std::string allow(const std::function<bool()>& stop);

  /// The servo's newest sample.
  const Sample& newest() noexcept;
  /// It gives no readings, not only in passing.
  bool device_is_gone() noexcept;
  /// \throws EndOfSession where the watchdog has ended or hangs, by the sample that newest() gave
  /// last: forces are zero and cannot come back.
  void end_without_guard() const;

 private:
  template <class Wished>
  bool await(Wished wished, double seconds, const std::function<bool()>& stop);
  std::string open_again(const std::function<bool()>& stop);

  ServoThread& servo_;
  GuardedDevice* guard_;
  Clock& clock_;
  Sample sample_;
};

}  // namespace palpate::runner
