#include "runner/safety/fault_signals.h"

#include <cerrno>
#include <csignal>
#include <ctime>
#include <stdexcept>

namespace palpate::runner::safety {
namespace {

constexpr int kAsked[] = {SIGINT, SIGTERM, SIGHUP};
constexpr int kDying[] = {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
constexpr int kZeroPatience_ms = 20;  // ms, for the servo to send zero

// A handler receives only the signal's number.
std::atomic<FaultSignals*> installed{nullptr};

void handle(int signal, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigemptyset(&action.sa_mask);
  sigaction(signal, &action, nullptr);
}

}  // namespace

FaultSignals::FaultSignals() {
  FaultSignals* none = nullptr;
  if (!installed.compare_exchange_strong(none, this))
    throw std::logic_error("two FaultSignals at a time");
  for (const int signal : kAsked) handle(signal, asked_to_end, SA_RESTART);
  for (const int signal : kDying) handle(signal, dying, static_cast<int>(SA_RESETHAND));
}

FaultSignals::~FaultSignals() {
  for (const int signal : kAsked) handle(signal, SIG_DFL, 0);
  for (const int signal : kDying) handle(signal, SIG_DFL, 0);
  installed.store(nullptr);
}

void FaultSignals::zero_force() noexcept {
  if (GuardedDevice* const guard = guard_.load()) guard->emergency_zero();
  if (servo::ServoThread* const servo = servo_.load()) servo->emergency_zero();
}

void FaultSignals::asked_to_end(int signal) {
  const int error = errno;
  if (FaultSignals* const self = installed.load()) {
    self->zero_force();
    self->end_requested_.store(signal);
  }
  handle(signal, SIG_DFL, 0);
  errno = error;
}

void FaultSignals::dying(int signal) {
  if (FaultSignals* const self = installed.load()) {
    self->zero_force();
    servo::ServoThread* const servo = self->servo_.load();
    // If the servo's own thread is failing, do not wait: the guard has the request.
    const timespec millisecond{0, 1'000'000};
    for (int i = 0; i < kZeroPatience_ms && servo != nullptr && !servo->in_this_thread() &&
                    !servo->forces_are_off();
         ++i) {
      nanosleep(&millisecond, nullptr);
    }
  }
  raise(signal);  // SA_RESETHAND: ends the program as usual, with a core dump
}

}  // namespace palpate::runner::safety
