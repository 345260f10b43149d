#pragma once
// A passivity observer and controller in the time domain: damping dissipates the energy that a
// sampled and held force feeds to the hand beyond that of the scene in continuous time.

#include "runner/servo/force_limiter.h"
#include "stimuli/vec.h"

namespace palpate::runner::servo {

struct PassivitySettings {
  /// N s/m, largest damping. More would itself be unstable with a light stylus (half of mass over
  /// tick at 0.1 kg and 1 kHz).
  double most_damping = 50;
};

/// Hannaford & Ryu 2002, "Time-domain passivity control of haptic interfaces". Departs: the energy
/// that leaves the port is compared with that of the same forces changing continuously with the
/// motion (trapezoids), after Ryu, Kim & Hannaford 2004, "Sampled- and continuous-time passivity
/// and stability of virtual environments". Excess energy of a spring is thus detected at every
/// tick, not only at the end of a contact, when the stored energy is spent. Energy dissipated by
/// friction and damping is not credited. Both devices share one account, because a stylus carries
/// energy from one to the other.
class PassivityController {
 public:
  PassivityController(const PassivitySettings& settings, double tick)
      : settings_(settings), tick_(tick) {}

  struct Ends {
    Vec3 tip, tail;  ///< m, device frame
  };

  /// The damping forces on the hand, N, to be added to `scene`; they never push along the motion.
  /// \param at     places of the devices
  /// \param scene  N, the forces without the controller, after the limits
  DeviceForces damping(const Ends& at, const DeviceForces& scene) noexcept;
  /// Sets the forces finally commanded, N; they count in the next tick's energy.
  void commanded(const DeviceForces& forces) noexcept { commanded_ = forces; }
  /// Resets the account; call it when a trial begins or positions jump.
  void reset() noexcept;

  double excess() const noexcept { return excess_; }  ///< J, fed to the hand and not yet dissipated

 private:
  PassivitySettings settings_;
  double tick_;
  bool started_ = false;
  Ends last_{};
  DeviceForces commanded_{}, scene_{};  ///< of the last tick
  Vec3 towards1_, towards2_;  ///< unit, along the last force on each device; zero: none yet
  double excess_ = 0;
};

}  // namespace palpate::runner::servo
