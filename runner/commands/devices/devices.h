#pragma once
// Parts of the devices command: --calibrate, --sound, and --report FILE, the facts about a lab's
// device that palpate's developers need, in one file without personal data.

#include <boost/program_options.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runner/devices/registry.h"

namespace palpate::runner::commands {

/// The options that only calibration has.
void add_calibrate_options(boost::program_options::options_description& options);

/// Guides the experimenter through the calibration of a device and stores it in config.calibration
/// (falcon: force by weights; pairs: registration of both frames) or in the device, which moves its
/// arm (forcedimension). \returns the exit status. \throws UsageError, std::runtime_error.
int calibrate_devices(const devices::DeviceKind& kind, const servo::DeviceConfig& config,
                      const boost::program_options::variables_map& values);

/// The time of a measurement.
std::string now_utc();

/// Measures how late contacts are heard at a sound device, by a cable that leads back to an input,
/// prints it, adds it to the report and stores it beside a calibration ("": nowhere).
/// \return the exit status
int measure_sound(const std::string& device, const std::string& input,
                  const std::string& calibration, nlohmann::ordered_json& report);

/// Kernel, processor and real-time rights, without names of computers or users.
nlohmann::ordered_json machine_facts();

/// Removes personal data from all texts: a serial number keeps its last two letters, a path its
/// file name; names of the user, the home folder and the computer are left out.
/// \param serials  requested ones, besides those in the findings
nlohmann::ordered_json without_personal_data(nlohmann::ordered_json findings,
                                             std::vector<std::string> serials);

}  // namespace palpate::runner::commands
