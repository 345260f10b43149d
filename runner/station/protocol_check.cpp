#include "runner/station/protocol_check.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "data/base/cell_name.h"
#include "protocols/factors.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/devices/registry.h"
#include "runner/devices/simulated.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/effect_check.h"
#include "runner/session/simulated_study.h"
#include "runner/sound/sound_output.h"
#include "runner/sound/sound_source.h"
#include "runner/study/duration.h"
#include "runner/study/study_order.h"

namespace palpate::runner::station {
namespace {

using Json = nlohmann::ordered_json;

/// Place of a stimulus by its name, or by that with a level, "ball at 405"; "": there is none.
std::string place_of_stimulus(const std::string& name, const protocols::Protocol& protocol) {
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const std::string& known = protocol.stimuli[i].name;
    if (name == known || name.starts_with(known + " at "))
      return "/stimuli/" + std::to_string(protocol.stimuli[i].place);
  }
  return "";
}

std::string place_of_renderer(const std::string& name, const protocols::Protocol& protocol) {
  for (std::size_t i = 0; i < protocol.renderers.size(); ++i) {
    if (name == protocols::to_string(protocol.renderers[i]))
      return "/renderers/" + std::to_string(i);
  }
  return "";
}

/// A sentence "stimulus 'ball' has ..." apart: its place, and what it says of it.
struct SplitReason {
  std::string where, rest;
};

SplitReason split(const std::string& reason, const protocols::Protocol& protocol) {
  for (const bool of_stimulus : {true, false}) {
    const std::string begin = of_stimulus ? "stimulus '" : "renderer '";
    if (!reason.starts_with(begin)) continue;
    const std::size_t end = reason.find('\'', begin.size());
    if (end == std::string::npos) continue;
    const std::string name = reason.substr(begin.size(), end - begin.size());
    std::string rest = reason.substr(end + 1);
    rest = rest.substr(0, rest.find("; likewise "));
    return {of_stimulus ? place_of_stimulus(name, protocol) : place_of_renderer(name, protocol),
            rest};
  }
  return {"", reason};
}

Json verdict_json(const Verdict& verdict, const protocols::Protocol& protocol) {
  Json out{{"name", verdict.name}, {"can", verdict.reasons.empty()}, {"reasons", Json::array()}};
  for (const GroupedReason& reason : grouped(verdict.reasons, protocol))
    out["reasons"].push_back({{"text", reason.text}, {"where", reason.where}});
  if (verdict.reasons.empty() && !verdict.limited.empty()) {
    for (const session::LimitedMaterial& one : verdict.limited) out["limits"].push_back(one.text);
  }
  if (verdict.chain) out["delay_s"] = verdict.chain->counted();
  return out;
}

Json block_json(const protocols::Protocol& protocol, const protocols::TaskBlock& block) {
  Json out{{"name", block.name}, {"task", protocols::to_string(block.task)}};
  Json& shown = out["stimuli"];
  for (const int stimulus : block.stimuli) {
    const Json name = base_name(protocol.stimuli[static_cast<std::size_t>(stimulus)].name);
    if (std::ranges::find(shown, name) == shown.end()) shown.push_back(name);
  }
  if (!block.factors.empty()) out["cells"] = block.cell ? 1 : protocols::cells_of(block);
  for (const protocols::LevelDimension& one : block.dimensions)
    out["dimensions"].push_back({{"name", one.name},
                                 {"path", one.target.pointer},
                                 {"unit", protocols::unit_of_level(one.target.pointer)},
                                 {"of", to_string(one.of)}});
  out["session"] = block.session;
  out["practice"] = block.practice;
  out["adaptive"] = protocols::is_adaptive(block);
  out["trials"] = protocols::expected_trials_of(block);
  out["most_trials"] = protocols::most_trials_of(block);
  return out;
}

Json summary_json(const protocols::Protocol& protocol) {
  Json out{{"kind", "protocol"},
           {"version", protocol.version},
           {"name", protocol.name},
           {"title", protocol.title},
           {"renderers", Json::array()},
           {"stimuli", Json::array()},
           {"sessions", protocol.sessions.count}};
  for (const protocols::RendererKind kind : protocol.renderers)
    out["renderers"].push_back(protocols::to_string(kind));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    if (stimulus.name == base_name(stimulus.name)) out["stimuli"].push_back(stimulus.name);
  }
  for (const protocols::Factor& factor : protocol.factors) {
    for (const protocols::FactorLevel& level : factor.levels)
      out["factors"][factor.name].push_back(level.name);
  }
  for (const protocols::TaskBlock* const block : protocols::listed_blocks(protocol))
    out["blocks"].push_back(block_json(protocol, *block));
  out["trials"] = study::planned_trials(protocol);
  if (protocol.groups.any()) {
    const GroupAssignment groups = protocol.groups.unmasked();
    out["groups"] = {{"names", groups.names}, {"assign", to_string(groups.rule)}};
    if (protocol.groups.masked()) out["groups"]["masked_as"] = protocol.groups.listed();
  }
  out["seed"] = protocol.seed;
  out["sha256"] = protocol.sha256;
  return out;
}

/// \param noise  of the protocol
std::string masked_note(const protocols::SoundSpec& sound, const protocols::MaskingNoise& noise) {
  constexpr double kTap = 0.2;  // m/s, of an ordinary tap
  double loudest = sound.modes.empty() ? 1 : 0;
  for (const protocols::SoundSpec::Mode& mode : sound.modes) loudest += mode.gain;
  const double rms = std::min(kTap * sound.gain * loudest, sound::kLoudest) / std::sqrt(2.0);
  if (rms > 0 && 20 * std::log10(rms) >= noise.level_db) return {};
  return "/sound/gain_per_m_per_s: at 0.2 m/s its loudest moment is below the masking noise of " +
         protocols::level_text(noise.level_db) + " dB";
}

}  // namespace

servo::DeviceConfig device_config(const protocols::Protocol& protocol) {
  servo::DeviceConfig config;
  config.rate = protocol.servo_rate;
  config.stylus_length = protocol.stylus.length;
  config.stylus_grip = protocol.stylus.grip;
  return config;
}

std::vector<Verdict> device_verdicts(const protocols::Protocol& protocol,
                                     const StimulusLibrary& library,
                                     const std::vector<devices::ChainTiming>& measured) {
  const servo::DeviceConfig config = device_config(protocol);
  std::vector<Verdict> out;
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    Verdict& verdict = out.emplace_back();
    verdict.name = kind.name;
    servo::DeviceCapabilities can = kind.nominal(config);
    const auto chain = std::ranges::find(measured, kind.name, &devices::ChainTiming::device);
    if (chain != measured.end()) {
      verdict.chain = *chain;
      can = devices::with_delay(can, chain->counted(), protocol.servo_rate);
    }
    protocols::Protocol shown = protocol;
    verdict.limited = session::limit_materials(shown, can);
    verdict.reasons = session::incompatibilities(shown, library, can);
  }
  return out;
}

std::vector<std::string> effect_notes(const protocols::Protocol& protocol,
                                      const StimulusLibrary& library) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    const protocols::StimulusSpec& stimulus = protocol.stimuli[i];
    const std::string begin = "stimulus " + stimulus.name + ": ";
    for (const std::string& note :
         session::effect_notes(stimulus.object, library.texture(i), protocol.servo_rate))
      out.push_back(begin + note);
    if (!stimulus.sound || !protocol.masking_noise) continue;
    const std::string note = masked_note(*stimulus.sound, *protocol.masking_noise);
    if (!note.empty()) out.push_back(begin + note);
  }
  return out;
}

std::vector<protocols::Fault> sound_faults(const protocols::Protocol& protocol,
                                           const std::string& file) {
  constexpr double kRate = 48000;  // Hz, any
  std::vector<protocols::Fault> faults;
  sound::SoundSources sources(kRate);
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    if (!stimulus.sound) continue;
    const std::string place = "/stimuli/" + std::to_string(stimulus.place) + "/sound/file";
    const auto told = [&](const protocols::Fault& fault) { return fault.location == place; };
    if (std::ranges::any_of(faults, told)) continue;
    try {
      sources.of(*stimulus.sound);
    } catch (const sound::SoundError& error) {
      faults.push_back({file, place, error.what(), 0});
    }
  }
  return faults;
}

Verdict simulation_verdict(const protocols::Protocol& protocol, const StimulusLibrary& library) {
  const participants::SimulatedSettings settings = participants::load_simulated_settings("");
  const devices::SimulatedStylus stylus(settings.device, settings.hand, protocol.stylus.length,
                                        protocol.stylus.grip, 1 / protocol.servo_rate);
  Verdict out;
  out.name = "simulate";
  protocols::Protocol shown = protocol;
  out.limited = session::limit_materials(shown, stylus.capabilities());
  out.reasons = session::simulation_faults(shown, library, settings);
  return out;
}

std::vector<GroupedReason> grouped(const std::vector<std::string>& reasons,
                                   const protocols::Protocol& protocol) {
  std::vector<GroupedReason> out;
  std::map<std::string, std::size_t> known;  // by what is said
  for (const std::string& reason : reasons) {
    const SplitReason parts = split(reason, protocol);
    const auto [at, is_new] = known.emplace(parts.rest, out.size());
    if (is_new)
      out.push_back({reason.substr(0, reason.find("; likewise ")), {}, 0});
    else
      ++out[at->second].others;
    std::vector<std::string>& where = out[at->second].where;
    if (!parts.where.empty() && std::ranges::find(where, parts.where) == where.end())
      where.push_back(parts.where);
  }
  return out;
}

Json faults_json(const std::string& file, const std::vector<protocols::Fault>& faults) {
  Json out{{"version", 1}, {"file", file}, {"faults", Json::array()}};
  for (const protocols::Fault& fault : faults) {
    Json& one = out["faults"].emplace_back();
    one = {{"pointer", fault.location},
           {"line", fault.line > 0 ? Json(fault.line) : Json(nullptr)},
           {"text", fault.expected}};
    if (fault.file != file) one["file"] = fault.file;
  }
  return out;
}

Json protocol_json(const std::string& file, const protocols::Protocol& protocol,
                   const StimulusLibrary& library,
                   const std::vector<devices::ChainTiming>& measured,
                   const std::vector<std::string>& notes) {
  Json out = faults_json(file, {});
  out["summary"] = summary_json(protocol);
  out["notes"] = notes;
  for (const std::string& note : effect_notes(protocol, library)) out["notes"].push_back(note);
  out["devices"] = Json::array();
  const auto add = [&](const protocols::Protocol& shown, const StimulusLibrary& stimuli,
                       const std::string& group) {
    std::vector<Verdict> verdicts = device_verdicts(shown, stimuli, measured);
    verdicts.push_back(simulation_verdict(shown, stimuli));
    for (const Verdict& verdict : verdicts) {
      out["devices"].push_back(verdict_json(verdict, shown));
      if (!group.empty()) out["devices"].back()["group"] = group;
    }
  };
  if (!protocol.groups.any()) add(protocol, library, "");
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i) {
    const protocols::Protocol& group = *protocol.group_protocols[i];
    add(group, StimulusLibrary(group), protocol.groups.true_name(i));
  }
  study::Duration duration = study::duration_of(protocol);
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i) {
    const protocols::Protocol& group = *protocol.group_protocols[i];
    const study::Duration own = study::duration_of(group);
    out["groups"].push_back({{"name", protocol.groups.true_name(i)},
                             {"summary", summary_json(group)},
                             {"duration_s", own.usual},
                             {"longest_s", own.longest}});
    if (i == 0) duration = own;
    duration.usual = std::max(duration.usual, own.usual);
    duration.longest = std::max(duration.longest, own.longest);
  }
  // Of groups the longest.
  out["duration_s"] = duration.usual;
  out["longest_s"] = duration.longest;
  return out;
}

}  // namespace palpate::runner::station
