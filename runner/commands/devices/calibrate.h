#pragma once
// `palpate devices --calibrate`: called by the devices command.

#include <boost/program_options.hpp>

#include "runner/devices/registry.h"

namespace palpate::runner::commands {

/// The options that only calibration has.
void add_calibrate_options(boost::program_options::options_description& options);

/// Guides the experimenter through the calibration of a device and stores it in config.calibration
/// (falcon: force by weights; pairs: registration of both frames) or in the device, which moves its
/// arm (forcedimension). \returns the exit status. \throws UsageError, std::runtime_error.
int calibrate_devices(const devices::DeviceKind& kind, const servo::DeviceConfig& config,
                      const boost::program_options::variables_map& values);

}  // namespace palpate::runner::commands
