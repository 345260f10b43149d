#pragma once
// Results of `palpate validate` as values: faults, a summary, which devices can show it
// and why not.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "runner/devices/device_delay.h"
#include "runner/scene_builder.h"
#include "runner/servo/device.h"
#include "runner/session/device_check.h"

namespace palpate::runner::station {

/// Whether a device, or the simulated participants with theirs, can show a protocol.
struct Verdict {
  std::string name;                               ///< of the kind of device; "simulate"
  std::vector<std::string> reasons;               ///< why not, a sentence each; empty: it can
  std::vector<session::LimitedMaterial> limited;  ///< what it scales down
  std::optional<devices::ChainTiming> chain;      ///< the measured delay that was counted
};

/// The facts of a protocol that a device needs before it is opened.
servo::DeviceConfig device_config(const protocols::Protocol& protocol);

/// Every kind of device, in the registry's order.
/// \param measured  delays of devices, which lower the stiffness that they can show
std::vector<Verdict> device_verdicts(const protocols::Protocol& protocol,
                                     const StimulusLibrary& library,
                                     const std::vector<devices::ChainTiming>& measured);
Verdict simulation_verdict(const protocols::Protocol& protocol, const StimulusLibrary& library);

/// Sentences that whoever runs the study should know of its stimuli' effects and sounds.
std::vector<std::string> effect_notes(const protocols::Protocol& protocol,
                                      const StimulusLibrary& library);

/// The recordings that cannot be read, each with its place. \param file  of the protocol
std::vector<protocols::Fault> sound_faults(const protocols::Protocol& protocol,
                                           const std::string& file);

/// A cause, and all places that have it.
struct GroupedReason {
  std::string text;                ///< the first place's sentence
  std::vector<std::string> where;  ///< JSON pointers; empty: the protocol as a whole
  std::size_t others = 0;          ///< sentences besides the first
};
/// Joins sentences that differ only in the stimulus, its level or the renderer that they name.
std::vector<GroupedReason> grouped(const std::vector<std::string>& reasons,
                                   const protocols::Protocol& protocol);

/// The faults of a file, or none, as JSON: {"version", "file", "faults"}.
nlohmann::ordered_json faults_json(const std::string& file,
                                   const std::vector<protocols::Fault>& faults);
/// The same with "summary", "devices" and "duration_s" of a protocol without faults.
nlohmann::ordered_json protocol_json(const std::string& file, const protocols::Protocol& protocol,
                                     const StimulusLibrary& library,
                                     const std::vector<devices::ChainTiming>& measured,
                                     const std::vector<std::string>& notes);

}  // namespace palpate::runner::station
