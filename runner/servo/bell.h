#pragma once
// Wakes the session's thread for news of other threads than the servo's: a tick calls the system
// only to sleep.

#include <semaphore.h>

#include <cerrno>
#include <cstdint>
#include <ctime>

namespace palpate::runner::servo {

/// One thread waits; any but the servo's may ring. Rings before a wait are kept, several as one.
class Bell {
 public:
  Bell() { sem_init(&rung_, 0, 0); }
  ~Bell() { sem_destroy(&rung_); }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;

  void ring() noexcept {
    int rung = 0;
    sem_getvalue(&rung_, &rung);
    if (rung <= 0) sem_post(&rung_);
  }
  /// At most so long. \return whether it rang
  bool wait(std::int64_t for_ns) noexcept {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    const std::int64_t ns = until.tv_nsec + for_ns;
    until.tv_sec += ns / kSecond;
    until.tv_nsec = ns % kSecond;
    while (sem_clockwait(&rung_, CLOCK_MONOTONIC, &until) != 0)
      if (errno != EINTR) return false;
    return true;
  }

 private:
  static constexpr std::int64_t kSecond = 1'000'000'000;
  sem_t rung_{};
};

}  // namespace palpate::runner::servo
