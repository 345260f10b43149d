#include "runner/station/opening.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "data/base/text.h"
#include "protocols/event_codes.h"
#include "protocols/tasks/texts.h"
#include "runner/display/text_display.h"
#include "runner/servo/realtime.h"
#include "runner/session/device_check.h"
#include "runner/usage_error.h"

namespace palpate::runner::station {
const devices::DeviceKind& find_device_kind(const std::string& name) {
  try {
    return devices::device_kind(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--device: ") + error.what());
  }
}

OpenDevice open_device(const devices::DeviceKind& kind, const RunSettings& settings,
                       const protocols::Protocol& protocol) {
  const servo::DeviceConfig config{
      protocol.servo_rate, protocol.stylus.length, protocol.stylus.grip, settings.serials,
      settings.firmware,   settings.calibration,   settings.library,     settings.service};
  try {
    kind.check(config);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--serial: ") + error.what());
  }
  if (!kind.has_force_feedback) return {kind.open(config), nullptr};
  safety::GuardSettings guard;
  guard.rate = protocol.servo_rate;
  auto guarded = std::make_unique<safety::GuardedDevice>([&] { return kind.open(config); }, guard);
  safety::GuardedDevice* const itself = guarded.get();
  return {std::move(guarded), itself};
}

void check_fitness(const OpenDevice& open, const RunSettings& settings,
                   const protocols::Protocol& protocol, const StimulusLibrary& library) {
  const servo::DeviceCapabilities& able = open.device->capabilities();
  std::string reasons;
  for (const std::string& reason : session::incompatibilities(protocol, library, able))
    reasons += "\n" + reason;
  if (!reasons.empty()) throw UsageError("this protocol cannot be run with this device:" + reasons);
  std::size_t answers = 0;
  for (const protocols::TaskBlock& block : protocol.blocks)
    answers = std::max(answers, block.answers.size());
  if (settings.buttons && answers > 8)
    throw UsageError("--buttons: a device has 8 buttons at most; the protocol has " +
                     std::to_string(answers) + " answers");
  const bool unfit =
      able.calibration.rfind("stale", 0) == 0 || able.calibration.rfind("implausible", 0) == 0;
  if (open.guard == nullptr || settings.without_calibration ||
      (!able.calibration.empty() && !unfit))
    return;
  throw UsageError("the calibration of '" + settings.device + "' is " +
                   (unfit ? able.calibration : "missing") +
                   "\n'palpate devices --calibrate' makes one, --calibration names its file, "
                   "--without-calibration runs the session without");
}

servo::ServoSettings servo_settings_of(const protocols::Protocol& protocol) {
  servo::ServoSettings settings;
  settings.rate = protocol.servo_rate;
  settings.workspace = workspace_of(protocol);
  settings.passivity_controller = protocol.passivity_controller;
  return settings;
}

std::vector<std::unique_ptr<session::MarkerSink>> open_markers(const RunSettings& settings) {
  const session::MarkerCodes codes = settings.marker_codes ? session::MarkerCodes::everywhere
                                                           : session::MarkerCodes::this_computer;
  std::vector<std::unique_ptr<session::MarkerSink>> sinks;
  for (const std::string& name : settings.markers) {
    try {
      sinks.push_back(session::open_marker_sink(name, codes));
    } catch (const std::invalid_argument& error) {
      throw UsageError(std::string("--markers: ") + error.what());
    }
  }
  return sinks;
}

std::unique_ptr<session::SampleStream> open_stream(const RunSettings& settings, double rate) {
  if (settings.stream.empty()) return nullptr;
  try {
    return std::make_unique<session::SampleStream>(settings.stream, rate);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--stream: ") + error.what());
  }
}

std::vector<std::string> notes_on_outlets(const RunSettings& settings,
                                          const protocols::Protocol& protocol,
                                          const sound::SoundPlayer* player) {
  using nlohmann::ordered_json;
  std::vector<std::string> notes;
  if ((protocol.sounds || has_contact_sound(protocol)) && player == nullptr)
    notes.emplace_back(R"({"sounds":"left out"})");
  if (protocol.masking_noise && player == nullptr)
    notes.emplace_back(R"({"masking_noise":"left out"})");
  if (!settings.markers.empty()) {
    const ordered_json sent = {{"markers", settings.markers},
                               {"codes", protocols::event_codes(protocol)},
                               {"sync", settings.sync}};
    notes.push_back(sent.dump());
  }
  if (!settings.stream.empty()) notes.push_back(ordered_json{{"stream", settings.stream}}.dump());
  return notes;
}

void print_dropped(const session::Markers& markers, const session::SampleStream* stream) {
  if (markers.dropped() > 0)
    std::fprintf(stderr, "%llu markers were not taken by their receivers\n",
                 static_cast<unsigned long long>(markers.dropped()));
  if (stream != nullptr && stream->dropped() > 0)
    std::fprintf(stderr, "%llu samples were not taken by the stream\n",
                 static_cast<unsigned long long>(stream->dropped()));
}

bool has_contact_sound(const protocols::Protocol& protocol) {
  return std::ranges::any_of(protocol.stimuli,
                             [](const auto& stimulus) { return stimulus.sound.has_value(); });
}

bool has_sound(const protocols::Protocol& protocol) {
  return protocol.masking_noise || protocol.sounds || has_contact_sound(protocol);
}

std::unique_ptr<sound::SoundPlayer> open_sound(const RunSettings& settings,
                                               const protocols::Protocol& protocol,
                                               servo::HeardTicks& heard) {
  if (settings.without_noise || !has_sound(protocol)) return nullptr;
  sound::SoundSettings wanted;
  wanted.device = settings.sound_device;
  wanted.noise = protocol.masking_noise;
  if (protocol.sounds) wanted.tones_db = protocol.sounds->level_db;
  wanted.seed = protocol.seed;
  if (has_contact_sound(protocol)) wanted.ticks = &heard;
  wanted.realtime = real_time_for_sound;
  auto player = std::make_unique<sound::SoundPlayer>(std::move(wanted));
  // Reads the recordings, before anybody waits for a trial.
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    player->contacts(stimulus.sound ? &*stimulus.sound : nullptr);
  player->contacts(nullptr);
  return player;
}

bool real_time_for_sound() {
  servo::RealtimeSettings realtime;
  realtime.priority = 70;  // below the servo's
  realtime.lock_memory = realtime.awake = false;
  return servo::request_realtime(realtime).fifo;
}

std::unique_ptr<participants::ResponseBox> open_response_box(
    const RunSettings& settings, const protocols::Protocol& protocol, servo::Clock& clock,
    const std::function<void()>& emergency) {
  if (settings.response_box.empty()) return nullptr;
  try {
    return std::make_unique<participants::ResponseBox>(settings.response_box,
                                                       protocol.responses.box, clock, emergency);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--response-box: ") + error.what());
  }
}

namespace {

/// Of the newest run that has any, whoever took part in it.
std::optional<display::WindowPlaces> last_places(data::Store& store) {
  std::optional<display::WindowPlaces> newest;
  std::int64_t utc_ns = 0;
  for (const data::StoredNote& note : store.notes()) {
    if (newest && note.run_clock.utc_ns < utc_ns) continue;
    const std::optional<display::WindowPlaces> places = display::window_places(note.text);
    if (!places) continue;
    newest = places;
    utc_ns = note.run_clock.utc_ns;
  }
  return newest;
}

}  // namespace

std::unique_ptr<display::DisplayLoop> open_display(const RunSettings& settings,
                                                   const protocols::Protocol& protocol,
                                                   data::Store& store, servo::Clock& clock,
                                                   servo::Device& device,
                                                   const std::function<void()>& emergency) {
  if (!settings.no_window) {
    display::WindowSettings window;
    window.quad_buffer = protocol.view && protocol.view->stereo == protocols::Stereo::quad_buffer;
    window.title = protocol.name + ", " + settings.participant;
    window.full_screen = settings.full_screen;
    window.ui_scale = settings.ui_scale;
    window.participant_monitor = settings.participant_monitor;
    window.console_monitor = settings.console_monitor;
    for (const auto& [key, text] : protocols::texts_of(protocol)) window.texts.push_back(text);
    window.joystick = protocol.responses.joystick;
    window.emergency = emergency;
    window.mouse = dynamic_cast<devices::MouseStylus*>(&device);
    window.workspace = workspace_of(protocol);
    window.clock = &clock;
    window.places = last_places(store);
    try {
      auto windows = display::make_windows(window);
      const std::string missing = windows->unreadable();
      if (!missing.empty()) std::fprintf(stderr, "%s\n", printable_lines(missing).c_str());
      const std::string warning = windows->warning();
      if (!warning.empty()) std::fprintf(stderr, "%s\n", warning.c_str());
      return windows;
    } catch (const display::DisplayError& error) {
      if (window.mouse != nullptr || protocol.view) throw;
      std::fprintf(stderr, "%s; a text display instead\n", printable(error.what()).c_str());
    }
  }
  return display::make_text_display({&clock, emergency});
}

}  // namespace palpate::runner::station
