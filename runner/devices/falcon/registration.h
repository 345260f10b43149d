#pragma once
// Registration: the relative pose of two Falcons that hold a stylus, from points that both reach.

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/guide.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

struct RegistrationSettings {
  double stylus_length = 0.12;  ///< m, between the centres of the grips on the stylus
  /// From the tip's grip to the tail's, m, tip's frame, while points are taken: zero with the grips
  /// pinned together, else the stylus in its jig (its direction must not change).
  Vec3 offset;
  int points = 8;
  double still = 0.5;  ///< s of rest at each point
};

/// The whole guided procedure; zero force. \throws GuideError, RegistrationError.
/// \param tip, tail  one Falcon each
PairRegistration register_pair(Device& tip, Device& tail, Clock& clock, Guide& guide,
                               const RegistrationSettings& settings);

}  // namespace palpate::runner::falcon
