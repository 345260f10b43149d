#pragma once
// The settings of `palpate run` from its command line.

#include <boost/program_options/options_description.hpp>
#include <optional>
#include <string>
#include <vector>

namespace palpate::runner::commands {

struct RunSettings {
  std::string protocol, database, participant, device;
  std::optional<int> number, session;
  std::string consent, hand, firmware, library, service, changed_protocol, calibration,
      sound_device = "default";
  std::vector<std::string> serials, markers;
  std::optional<double> response_latency;            ///< s, measured; recorded, never subtracted
  int participant_monitor = 0, console_monitor = 0;  ///< from 1; 0: as it comes
  double ui_scale = 0;                               ///< 0: from the monitors
  std::string language;      ///< of the protocol's texts; "": the original ones
  std::string stream;        ///< of the servo's samples: "lsl" or "lsl:NAME"; "": none
  std::string response_box;  ///< serial port; "": none
  bool spoken = false;       ///< the experimenter types the answers
  bool no_window = false, full_screen = false, buttons = false, without_calibration = false,
       without_noise = false, new_participant = false, after_withdrawal = false,
       marker_codes = false, sync = false;
  std::string advisor;          ///< socket of a program that proposes levels; empty: none
  double advisor_time_out = 1;  ///< s
};

/// The options that name and prepare a device: --serial, --firmware, --library, ...
void add_device_options(boost::program_options::options_description& options,
                        RunSettings& settings);
/// Those for other recorders: --markers, --sync, --stream, --marker-codes.
void add_recorder_options(boost::program_options::options_description& options,
                          RunSettings& settings);
/// \throws UsageError: options of other recorders that do not go together
void check_recorders(const RunSettings& settings);
/// Those for the participant's headphones: --sound-device, --without-noise.
void add_sound_options(boost::program_options::options_description& options, RunSettings& settings);

/// None where --help was asked for and printed. \throws UsageError
std::optional<RunSettings> parse_run_settings(const std::vector<std::string>& args);

}  // namespace palpate::runner::commands
