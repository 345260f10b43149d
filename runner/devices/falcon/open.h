#pragma once
// Opens Falcons from a DeviceConfig, ready but for homing: the functions behind the Falcon's rows
// in the registry of devices.

#include <memory>
#include <string>
#include <vector>

#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/driver.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

/// Falcons that are plugged in. \throws TransportError where USB cannot be used.
std::vector<ConnectedDevice> connected_falcons(const DeviceConfig& config);

/// See DeviceKind::nominal.
DeviceCapabilities nominal_falcon(const DeviceConfig& config);
DeviceCapabilities nominal_falcon2(const DeviceConfig& config);

/// See DeviceKind::check.
void check_falcon(const DeviceConfig& config);
void check_falcon2(const DeviceConfig& config);

/// One Falcon. Its capabilities' `calibration` is empty when none is stored, and begins with
/// "stale" when it is too old, with "implausible" when its scale is not used. \throws
/// TransportError, InputError.
std::unique_ptr<Device> open_falcon(const DeviceConfig& config);

/// The two that config.serials names, the one at the stylus' tip first. Their registration must be
/// in config.calibration. \throws TransportError, InputError.
std::unique_ptr<Device> open_falcon2(const DeviceConfig& config);

/// State of all calibrations that these devices need. Two serial numbers are a pair, tip and tail.
/// \param path  empty: none. \throws InputError.
CalibrationVerdict judge_calibration(const std::string& path,
                                     const std::vector<std::string>& serials);

/// The driver of one Falcon, with the calibrated scale of force if there is a plausible one. Shows
/// the progress of an upload on a terminal. \throws TransportError, InputError.
std::unique_ptr<FalconDriver> open_driver(const std::string& serial, const std::string& firmware,
                                          const Calibration& calibration);

}  // namespace palpate::runner::falcon
