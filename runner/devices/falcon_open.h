#pragma once
// From what a user names to a device that is ready but for its homing.

#include <memory>
#include <string>
#include <vector>

#include "runner/device.h"
#include "runner/devices/falcon_arm.h"
#include "runner/devices/falcon_boot.h"
#include "runner/devices/falcon_calibration.h"

namespace palpate::falcon {

struct FalconOptions {
  std::string firmware;     ///< file; needed once after each power-up; empty: none
  std::string calibration;  ///< file; empty: none, the nominal scale
  std::string serial;       ///< of the one, or at the tip; empty: the only one
  std::string tail_serial;  ///< at the tail; falcon2 only
};

struct OpenedDevice {
  std::unique_ptr<Device> device;
  std::vector<std::string> serials;
  CalibrationVerdict calibration;  ///< what the pre-flight needs to know
};

/// \throws TransportError, InputError.
OpenedDevice open_falcon(const FalconOptions& options, const BootReport& report = {});
/// Two with their registration, which must be in the calibration file.
/// \throws TransportError, InputError.
OpenedDevice open_falcon2(const FalconOptions& options, const BootReport& report = {});

/// One arm, with the scale of force of the calibration when it has one. \throws as above.
std::unique_ptr<FalconArm> open_arm(const std::string& serial, const std::string& firmware,
                                    const Calibration& calibration, const BootReport& report = {});

}  // namespace palpate::falcon
