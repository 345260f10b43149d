#pragma once
// A passivity observer and controller in the time domain: what a sampled and held force feeds to
// the hand beyond what the scene would give in continuous time is taken out again by damping.

#include "runner/servo/force_limiter.h"
#include "stimuli/vec.h"

namespace palpate::runner {

struct PassivitySettings {
  /// N s/m, of the damping at most; more would be a sampled instability of its own on a light
  /// stylus (half of mass over tick at 0.1 kg and 1 kHz).
  double most_damping = 50;
};

/// Hannaford & Ryu 2002, "Time-domain passivity control of haptic interfaces". Departs: the energy
/// that leaves the port is compared with what the same forces give when they change along with the
/// motion (trapezoids), after Ryu, Kim & Hannaford 2004, "Sampled- and continuous-time passivity
/// and stability of virtual environments". A spring is found out tick by tick, not at the end of a
/// contact, when what was stored has been spent; what friction and damping took is not on credit.
/// One account for both devices: a stylus carries energy from one to the other.
class PassivityController {
 public:
  PassivityController(const PassivitySettings& settings, double tick)
      : settings_(settings), tick_(tick) {}

  struct Ends {
    Vec3 tip, tail;  ///< m, device frame
  };

  /// The damping forces on the hand, N, to be added to `scene`; they never push along the motion.
  /// \param at     where the devices are
  /// \param scene  N, what would be commanded without the controller, after the limits
  DeviceForces damping(const Ends& at, const DeviceForces& scene) noexcept;
  /// What was commanded in the end, N: the next tick's energy is counted with it.
  void commanded(const DeviceForces& forces) noexcept { commanded_ = forces; }
  /// A trial begins, or positions jump: forgets all.
  void reset() noexcept;

  double excess() const noexcept { return excess_; }  ///< J, fed to the hand and not yet taken out
  double taken_out() const noexcept { return taken_; }  ///< J, asked of the damping since reset

 private:
  PassivitySettings settings_;
  double tick_;
  bool started_ = false;
  Ends last_{};
  DeviceForces commanded_{}, scene_{};  ///< of the last tick
  Vec3 towards1_, towards2_;            ///< unit, of the last force on each device; zero: none yet
  double excess_ = 0, taken_ = 0;
};

}  // namespace palpate::runner
