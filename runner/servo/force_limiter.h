#pragma once
// The last step before the device: limits the size and the change of commanded forces; zero if a
// force is not finite.

#include "stimuli/vec.h"

namespace palpate::runner::servo {

struct ForceLimits {
  double max_force = 6;     ///< N, of each device
  double max_change = 0.5;  ///< N per tick, of each device
  double ramp = 0.2;        ///< s, from zero to full force when forces go on
};

struct DeviceForces {
  Vec3 device1, device2;  ///< N, on the hand
  bool limited = false;   ///< size or change was reduced
};

class ForceLimiter {
 public:
  ForceLimiter(const ForceLimits& limits, double tick)
      : limits_(limits), ramp_step_(tick / limits.ramp) {}

  /// If one force is too strong, both are scaled together, so that the directions of force and
  /// moment stay. If a force is not finite: zero force (tripped) until clear().
  DeviceForces apply(const Vec3& device1, const Vec3& device2) noexcept;
  /// Zero force at once; the next apply starts a new ramp.
  void release() noexcept;
  /// Zero force at once and until clear().
  void trip() noexcept;
  /// Ramps down from the next apply() on, then acts as trip().
  void fade() noexcept { fading_ = true; }
  bool tripped() const noexcept { return tripped_; }
  void clear() noexcept { tripped_ = fading_ = false; }

 private:
  ForceLimits limits_;
  double ramp_step_;
  double ramp_ = 0;  ///< 0 to 1
  Vec3 last1_, last2_;
  bool tripped_ = false, fading_ = false;
};

}  // namespace palpate::runner::servo
