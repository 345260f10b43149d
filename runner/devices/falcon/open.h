#pragma once
// From what a user names to a device that is ready but for its homing: the Falcon's rows in the
// registry.

#include <memory>
#include <string>
#include <vector>

#include "runner/devices/falcon/arm.h"
#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/servo/device.h"
#include "runner/servo/device_config.h"

namespace palpate::runner::falcon {

/// Falcons that are plugged in. \throws TransportError where this computer cannot look.
std::vector<ConnectedDevice> connected_falcons();

/// See DeviceKind::check.
void check_falcon(const DeviceConfig& config);
void check_falcon2(const DeviceConfig& config);

/// One Falcon. Its capabilities' `calibration` is empty when none is stored, and begins with
/// "stale" when it is too old, with "implausible" when its scale is not used. \throws
/// TransportError, InputError.
std::unique_ptr<Device> open_falcon(const DeviceConfig& config);

/// Two, which config.serials names: first the one at the stylus' tip. Their registration must be in
/// config.calibration. \throws TransportError, InputError.
std::unique_ptr<Device> open_falcon2(const DeviceConfig& config);

/// For a pre-flight that has the serial numbers: is all calibrated that these need, and not too
/// long ago? Two are a pair, tip and tail. \param path  empty: none. \throws InputError.
CalibrationVerdict judge_calibration(const std::string& path,
                                     const std::vector<std::string>& serials);

/// One arm, with the scale of force of the calibration when it has one. Tells the progress of an
/// upload to a terminal. \throws TransportError, InputError.
std::unique_ptr<FalconArm> open_arm(const std::string& serial, const std::string& firmware,
                                    const Calibration& calibration);

}  // namespace palpate::runner::falcon
