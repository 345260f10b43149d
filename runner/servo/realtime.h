#pragma once
// The computer's clock; real-time scheduling and locked memory, which keep ticks on time.

#include <string>

#include "runner/servo/device.h"

namespace palpate::runner::servo {

/// CLOCK_MONOTONIC; waits by absolute time (clock_nanosleep).
class RealClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override;
  void wait_until(std::int64_t when_ns) noexcept override;
};

struct RealtimeSettings {
  int priority = 80;        ///< of SCHED_FIFO, 1 to 99; 0: leave the ordinary scheduler
  bool lock_memory = true;  ///< keep all pages of this program in memory
  int core = -1;            ///< run only on this processor; -1: any
  bool awake = true;        ///< keep idle processors quick to wake (AwakeProcessors)
};

/// The rights granted.
struct RealtimeRights {
  bool fifo = false, locked_memory = false;
  int core = -1;
  bool awake = false;
  std::string missing;  ///< rights denied and their consequences; empty: none
};

/// While it lives, keeps idle processors out of deep sleep states, from which waking takes time
/// (the kernel's PM QoS, /dev/cpu_dma_latency), if allowed. Costs power.
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

/// Requests the settings for the calling thread (memory: for the whole program) and accepts partial
/// grants.
RealtimeRights request_realtime(const RealtimeSettings& settings);

}  // namespace palpate::runner::servo
