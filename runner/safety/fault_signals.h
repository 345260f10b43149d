#pragma once
// Signal handlers: zero force before any signal ends the program.

#include <atomic>

#include "runner/safety/guarded_device.h"
#include "runner/servo/servo_thread.h"

namespace palpate::runner {

/// While one of these lives, SIGINT, SIGTERM and SIGHUP command zero force and ask the session to
/// end (the second one ends the program as usual); SIGABRT (failed assert, exception that nobody
/// caught), SIGSEGV, SIGBUS, SIGFPE and SIGILL command zero force, wait for it to be sent, and end
/// the program as usual. One at a time, made and destroyed in one thread.
class FaultSignals {
 public:
  FaultSignals();
  ~FaultSignals();
  FaultSignals(const FaultSignals&) = delete;
  FaultSignals& operator=(const FaultSignals&) = delete;

  /// Which forces are meant; null: none (any more). What is watched must outlive its watch.
  void watch(ServoThread* servo) noexcept { servo_.store(servo); }
  void watch(GuardedDevice* guard) noexcept { guard_.store(guard); }
  /// The signal that asked for the end; 0: none.
  int end_requested() const noexcept { return end_requested_.load(); }

 private:
  static void asked_to_end(int signal);
  static void dying(int signal);
  void zero_force() noexcept;

  std::atomic<ServoThread*> servo_{nullptr};
  std::atomic<GuardedDevice*> guard_{nullptr};
  std::atomic<int> end_requested_{0};
};

}  // namespace palpate::runner
