#pragma once
// With what a session, a server or a scene is run: device, displays, outlets, participant.

#include <optional>
#include <string>
#include <vector>

namespace palpate::runner::station {

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
  std::string group;            ///< of a new participant, as the experimenter decided
  bool fill = false;            ///< the group that the fewest have completed
  std::string advisor;          ///< socket of a program that proposes levels; empty: none
  double advisor_time_out = 1;  ///< s
};

}  // namespace palpate::runner::station
