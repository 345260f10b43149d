#pragma once
// What has been measured of each Falcon, kept in a file that the user names. A device that is not
// in it has a scale of force that may be wrong by a factor of 2 to 4.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::falcon {

/// Scale of force of one device, from known weights.
struct ForceCalibration {
  std::string serial;
  double counts_per_torque = 0;  ///< 1/(N m) at the thighs; negative
  double residual = 0;           ///< N, root mean square of the weights about the line
  double sideways = 0;           ///< N across for each N of weight; 0 for a perfect device
  double arm_weight = 0;         ///< N that the arms themselves weigh (or float)
  std::vector<double> weights;   ///< kg
  std::string made_utc;          ///< ISO 8601
};

/// Where two devices that hold a stylus stand to each other.
struct PairRegistration {
  std::string tip_serial, tail_serial;
  Pose tail_in_tip;          ///< of the tail device's world frame in the tip device's
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
  /// Takes the place of an older one of the same device or pair.
  void put(const ForceCalibration& force);
  void put(const PairRegistration& pair);
};

/// A file that is not there holds nothing. \throws InputError with every fault, also where another
/// user could have written the file: its scale decides what force reaches a hand.
Calibration read_calibration(const std::string& path);
Calibration parse_calibration(const std::string& text, const std::string& path);
std::string to_json(const Calibration& calibration);

/// By rising gravity. An implausible scale is that of other motors than a Falcon's, or of weights
/// that were mistyped: it is not used.
enum class CalibrationState : std::uint8_t { good, stale, implausible, missing };
struct CalibrationVerdict {
  CalibrationState state = CalibrationState::good;
  std::string text;  ///< one sentence for each device, with what would help
};

inline constexpr double kCalibrationDays = 90;  ///< gears wear and motors age; then weigh again

/// Is the scale within kBelievableFactor of the nominal one? Beyond it the limits, which count by
/// the scale, would let a multiple of their force through, or a push could not be felt.
bool believable(const ForceCalibration& force);

/// Is every device calibrated, believably, and not too long ago? \param unix_ns  now
CalibrationVerdict judge_forces(const Calibration& calibration,
                                const std::vector<std::string>& serials, std::int64_t unix_ns);
CalibrationVerdict judge_pair(const Calibration& calibration, const std::string& tip,
                              const std::string& tail, std::int64_t unix_ns);
/// The worse state, both texts.
CalibrationVerdict both(const CalibrationVerdict& a, const CalibrationVerdict& b);

}  // namespace palpate::runner::falcon
