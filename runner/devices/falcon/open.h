#pragma once
// Functions for the Falcon's rows in the registry of devices. They open Falcons from a
// DeviceConfig; only homing remains to be done.

#include <memory>
#include <string>
#include <vector>

#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/driver.h"
#include "runner/servo/device.h"

namespace palpate::runner::devices::falcon {

/// Connected Falcons. \throws TransportError if USB cannot be used.
std::vector<servo::ConnectedDevice> connected_falcons(const servo::DeviceConfig& config);

/// See DeviceKind::nominal.
servo::DeviceCapabilities nominal_falcon(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal_falcon2(const servo::DeviceConfig& config);

/// See DeviceKind::check.
void check_falcon(const servo::DeviceConfig& config);
void check_falcon2(const servo::DeviceConfig& config);

/// One Falcon. Its capabilities' `calibration` is empty if none is stored. It begins with "stale"
/// if too old, with "implausible" if its scale is not used. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon(const servo::DeviceConfig& config);

/// The two Falcons of config.serials, the one at the stylus' tip first. config.calibration must
/// have their registration. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon2(const servo::DeviceConfig& config);

/// State of all calibrations that these devices need. Two serial numbers are a pair, tip and tail.
/// \param path  empty: none. \throws InputError.
CalibrationVerdict judge_calibration(const std::string& path,
                                     const std::vector<std::string>& serials);

/// The driver of one Falcon, with the calibrated scale of force if there is a plausible one. Shows
/// the progress of an upload on a terminal. \throws TransportError, InputError.
std::unique_ptr<FalconDriver> open_driver(const std::string& serial, const std::string& firmware,
                                          const Calibration& calibration);

}  // namespace palpate::runner::devices::falcon
