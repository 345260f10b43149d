#pragma once
// What the pieces of `palpate run` hand to each other: what the command line asks for, and what a
// session works with.

#include <optional>
#include <string>
#include <vector>

#include "runner/commands/run/admission.h"
#include "runner/devices/registry.h"
#include "runner/display/window.h"
#include "runner/safety/fault_signals.h"
#include "runner/session/device_check.h"
#include "runner/session/force_direction_check.h"
#include "runner/session/live_session.h"

namespace palpate::runner {

/// What the command line asks for.
struct RunSettings {
  std::string protocol, database, participant, device;
  std::optional<int> number, session;
  std::string consent, hand, firmware, changed_protocol, calibration, sound_device = "default";
  std::vector<std::string> serials, markers;
  std::optional<double> response_latency;
  int participant_monitor = 0, console_monitor = 0;
  double ui_scale = 0;  ///< 0: from the monitors
  bool no_window = false, full_screen = false, buttons = false, without_calibration = false,
       without_noise = false, new_participant = false, after_withdrawal = false,
       marker_codes = false;
};

/// What the session's thread works with; all of it is owned by the main thread.
struct RunParts {
  const RunSettings& settings;
  const protocols::Protocol& protocol;
  const StimulusLibrary& library;
  const DeviceKind& kind;
  GuardedDevice* guard;
  const DeviceCapabilities& device;
  ServoThread& servo;
  Clock& clock;
  data::Store& store;
  DisplayLoop& display;
  Markers& markers;
  FaultSignals& signals;
  data::Participant participant;
  int session;
  const Admission& admission;
  NoisePlayer* noise;  ///< may be none
  const std::vector<LimitedMaterial>& limited;
  const ForceDirectionCheck& push;
};

}  // namespace palpate::runner
