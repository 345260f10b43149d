#pragma once
// Where the two Falcons of a stylus stand to each other, from places that both have seen.

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/guide.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

struct RegistrationSettings {
  double stylus_length = 0.12;  ///< m, between the centres of the grips on the stylus
  /// From the tip's grip to the tail's, m, tip's frame, while points are taken: zero where the
  /// grips are pinned together, else how the jig holds the stylus (its direction must not change).
  Vec3 offset;
  int points = 8;
  double still = 0.5;  ///< s that the grips rest at each
};

/// The whole procedure; no force is shown. \throws GuideError, RegistrationError.
/// \param tip, tail  one Falcon each
PairRegistration register_pair(Device& tip, Device& tail, Clock& clock, Guide& guide,
                               const RegistrationSettings& settings);

}  // namespace palpate::runner::falcon
