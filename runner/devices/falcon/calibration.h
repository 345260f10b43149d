#pragma once
// Calibrations of Falcons, in a file named by the user. Without calibration, a device's force scale
// may be wrong by a factor of 2 to 4.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/falcon/guide.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

/// Asks the experimenter to pull the grip out and push it in until the device is homed. Zero force.
/// \throws GuideError if stopped or if the device is unplugged.
void wait_until_homed(servo::Device& device, servo::Clock& clock, Guide& guide);

/// Force scale of one device, measured with known weights.
struct ForceCalibration {
  std::string serial;
  double counts_per_torque = 0;  ///< 1/(N m) at the thighs; negative
  double residual = 0;    ///< N, root mean square deviation of the weights from the fitted line
  double sideways = 0;    ///< horizontal N for each N of weight; ideally 0
  double arm_weight = 0;  ///< N, apparent weight of the device's arms; negative: they rise
  std::vector<double> weights;  ///< kg
  std::string made_utc;         ///< ISO 8601
};

/// Relative pose of two devices that hold a stylus.
struct PairRegistration {
  std::string tip_serial, tail_serial;
  Pose tail_in_tip;          ///< pose of the tail device's world frame in the tip device's
  double stylus_length = 0;  ///< m, between the centres of the two grips
  double residual = 0;       ///< m, root mean square of the paired points
  int points = 0;
  std::string made_utc;
};

struct Calibration {
  std::vector<ForceCalibration> forces;
  std::vector<PairRegistration> pairs;

  const ForceCalibration* force_of(const std::string& serial) const;
  const PairRegistration* pair_of(const std::string& tip, const std::string& tail) const;
  /// Adds a calibration; replaces an earlier one of the same device or pair.
  void put(const ForceCalibration& force);
  void put(const PairRegistration& pair);
};

/// A missing file gives an empty calibration. \throws InputError with every fault; also if another
/// user could have written the file, because it scales the forces on a hand.
Calibration read_calibration(const std::string& path);
Calibration parse_calibration(const std::string& text, const std::string& path);
std::string to_json(const Calibration& calibration);

/// In order of severity. An implausible scale cannot be that of a Falcon's motors (mistyped
/// weights?) and is not used.
enum class CalibrationState : std::uint8_t { good, stale, implausible, missing };
struct CalibrationVerdict {
  CalibrationState state = CalibrationState::good;
  std::string text;  ///< one sentence for each device, with the remedy
};

/// A calibration becomes stale after these days: cables and motors age.
inline constexpr double kCalibrationDays = 90;

/// Whether the scale is within kPlausibleFactor of the nominal one. With a wrong scale, forces
/// could exceed their limits by that factor, or be too weak to feel.
bool plausible(const ForceCalibration& force);

/// Whether every device has a plausible and recent calibration. \param unix_ns  now
CalibrationVerdict judge_forces(const Calibration& calibration,
                                const std::vector<std::string>& serials, std::int64_t unix_ns);
CalibrationVerdict judge_pair(const Calibration& calibration, const std::string& tip,
                              const std::string& tail, std::int64_t unix_ns);
/// The more severe state, with both texts.
CalibrationVerdict both(const CalibrationVerdict& a, const CalibrationVerdict& b);

}  // namespace palpate::runner::devices::falcon
