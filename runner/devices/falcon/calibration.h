#pragma once
// Calibrations of Falcons, in a file named by the user. Without calibration, a device's force scale
// may be wrong by a factor of 2 to 4.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

/// Dialog with the experimenter during a guided procedure: shows texts and questions, and polls for
/// answers. It never blocks: the devices need a tick every millisecond while a question waits for
/// its answer.
class Guide {
 public:
  virtual ~Guide() = default;
  virtual void say(const std::string& text) = 0;
  /// Shows a request, to be confirmed with ENTER.
  virtual void ask(const std::string& text) = 0;
  enum class Answer : std::uint8_t { none, proceed, stop };
  /// The answer to the last request, if there is one yet; never blocks.
  virtual Answer answer() = 0;
};

/// A guided procedure gave no result; what() gives the reason and the remedy.
class GuideError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

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
  bool sealed = true;           ///< false: of an older version, without a checksum
};

/// Relative pose of two devices that hold a stylus.
struct PairRegistration {
  std::string tip_serial, tail_serial;
  Pose tail_in_tip;          ///< pose of the tail device's world frame in the tip device's
  double stylus_length = 0;  ///< m, between the centres of the two grips
  double residual = 0;       ///< m, root mean square of the paired points
  int points = 0;
  std::string made_utc;
  bool sealed = true;  ///< as above
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

/// Each calibration has a checksum: a changed one is a fault, one without is stale.
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

/// Calibration of a Falcon's force with known weights. The device has no force sensor, but a
/// position controller can hold its grip: the weight equals the commanded force with it minus that
/// without it. The grip moves slowly up and down during each measurement, so that friction cancels.
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
