#pragma once
// When a device sensed and pushed, from which `palpate devices --timing --device NAME` measures the
// delay from a pose to its force.

#include <algorithm>
#include <cstdint>

namespace palpate::runner {

/// CLOCK_MONOTONIC, ns; 0: never.
struct DeviceTimes {
  std::int64_t pose_ns = 0;   ///< request or arrival of the last reading's pose
  std::int64_t force_ns = 0;  ///< the last force of Device::write left this program
};

/// Of two devices that hold one stylus: the older pose, the later force.
inline DeviceTimes later_of(const DeviceTimes& one, const DeviceTimes& other) {
  return {std::min(one.pose_ns, other.pose_ns), std::max(one.force_ns, other.force_ns)};
}

/// A Device that keeps its times. A driver with a thread of its own queues poses and forces, so
/// its caller cannot measure them.
class KeepsTimes {
 public:
  /// Called between reads and writes, in their thread.
  virtual DeviceTimes times() const noexcept = 0;

 protected:
  ~KeepsTimes() = default;
};

}  // namespace palpate::runner
