#pragma once
// The options of `palpate run`, and those that other commands share with it.

#include <boost/program_options/options_description.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runner/station/run_settings.h"

namespace palpate::runner::commands {

/// The options that name and prepare a device: --serial, --firmware, --library, ...
void add_device_options(boost::program_options::options_description& options,
                        station::RunSettings& settings);
/// Those for other recorders: --markers, --sync, --stream, --marker-codes.
void add_recorder_options(boost::program_options::options_description& options,
                          station::RunSettings& settings);
/// \throws UsageError: options of other recorders that do not go together
void check_recorders(const station::RunSettings& settings);
/// Those for the participant's headphones: --sound-device, --without-noise.
void add_sound_options(boost::program_options::options_description& options,
                       station::RunSettings& settings);

/// None where --help was asked for and printed. \throws UsageError
std::optional<station::RunSettings> parse_run_settings(const std::vector<std::string>& args);

}  // namespace palpate::runner::commands
