#pragma once
// Calibration of a Falcon's force with known weights. The device has no sensor of force, but it can
// hold its grip still: what the motors are told while it carries a weight, less what they are told
// without, is that weight. The grip moves slowly up and down meanwhile, so that friction, which
// helps on the way down and hinders on the way up, cancels.

#include <vector>

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/guide.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

struct WeighingSettings {
  std::vector<double> weights = {0.1, 0.2, 0.4};  ///< kg, each hung at the grip in turn
  double gravity = 9.80665;                       ///< m/s^2
  double settle = 3;                              ///< s, before each measurement
  double cycle = 4;                               ///< s, once up and down
  int cycles = 2;
  double sweep = 0.004;  ///< m, each way
};

/// One weight's measurement.
struct Weighing {
  double weight = 0;  ///< N
  Vec3 force;         ///< N, world frame, that the motors were told, by the nominal scale
};

/// The scale from weighings (the first without a weight). \throws GuideError where they make no
/// sense: no more force for more weight, or far off a line.
ForceCalibration fit_scale(const std::vector<Weighing>& weighings);

/// The whole procedure, at 1 kHz of the clock. Zero force before and after.
/// \param device  one Falcon, opened with its nominal scale; through a guard process, best
/// \throws GuideError when it is stopped, the device is lost, or the grip gets away.
ForceCalibration weigh(Device& device, Clock& clock, Guide& guide,
                       const WeighingSettings& settings);

}  // namespace palpate::runner::falcon
