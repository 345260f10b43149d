#pragma once
// Calibration of a Falcon's force with known weights. The device has no force sensor, but a
// position controller can hold its grip: the weight equals the commanded force with it minus that
// without it. The grip moves slowly up and down during each measurement, so that friction cancels.

#include <vector>

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/guide.h"
#include "runner/servo/device.h"

namespace palpate::runner::devices::falcon {

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
  Vec3 force;         ///< N, world frame, mean force commanded, by the nominal scale
};

/// The scale from weighings (the first without a weight). \throws GuideError if they are
/// inconsistent: force does not rise with weight, or is far from linear.
ForceCalibration fit_scale(const std::vector<Weighing>& weighings);

/// The whole guided procedure, at 1 kHz. Zero force before and after.
/// \param device  one Falcon, opened with its nominal scale; a guard process should own it
/// \throws GuideError if stopped, if the device is lost, or if the grip drifts away.
ForceCalibration weigh(servo::Device& device, servo::Clock& clock, Guide& guide,
                       const WeighingSettings& settings);

}  // namespace palpate::runner::devices::falcon
