#pragma once
// The computer's clock, and real-time scheduling and locked memory, which make ticks come in time.

#include <string>

#include "runner/servo/device.h"

namespace palpate::runner {

/// CLOCK_MONOTONIC; waits by absolute time (clock_nanosleep).
class RealClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override;
  void wait_until(std::int64_t when_ns) noexcept override;
};

struct RealtimeSettings {
  int priority = 80;        ///< of SCHED_FIFO, 1 to 99; 0: leave the ordinary scheduler
  bool lock_memory = true;  ///< no page of this program is swapped out or fetched late
  int core = -1;            ///< run on this processor alone; -1: any
  bool awake = true;        ///< idle processors wake at once (AwakeProcessors)
};

/// What was granted.
struct RealtimeRights {
  bool fifo = false, locked_memory = false;
  int core = -1;
  bool awake = false;
  std::string missing;  ///< what was asked for and not granted, and what that costs; empty: nothing
};

/// While it lives, idle processors do not fall so deep asleep that waking takes time (the kernel's
/// PM QoS, /dev/cpu_dma_latency), where that is allowed. Costs power.
class AwakeProcessors {
 public:
  explicit AwakeProcessors(bool wanted) noexcept;
  ~AwakeProcessors();
  AwakeProcessors(const AwakeProcessors&) = delete;
  AwakeProcessors& operator=(const AwakeProcessors&) = delete;
  bool granted() const noexcept { return file_ >= 0; }

 private:
  int file_ = -1;
};

/// Asks for the calling thread (memory: for the whole program). Goes on with what is granted.
RealtimeRights request_realtime(const RealtimeSettings& settings);

}  // namespace palpate::runner
