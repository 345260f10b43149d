#include "runner/commands/explore/hands_on.h"

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <utility>

#include "data/base/text.h"
#include "runner/commands/explore/live_touch.h"
#include "runner/commands/explore/recorded_touch.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/run/opening.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/scene_notes.h"
#include "runner/commands/shared/stop_signal.h"
#include "runner/display/explore_window.h"
#include "runner/safety/fault_signals.h"
#include "runner/serve/served_scene.h"
#include "runner/session/device_check.h"

namespace palpate::runner {
namespace {

namespace fs = std::filesystem;

/// Keeps pictures as scene-1.png and so on, the first number that is free; clips likewise.
std::string keep_in(const std::string& folder, const std::string& bytes, const char* kind) {
  try {
    fs::create_directories(folder);
    for (int number = 1;; ++number) {
      const fs::path path = fs::path(folder) / ("scene-" + std::to_string(number) + kind);
      if (fs::exists(path)) continue;
      write_whole(path.string(), bytes);
      return "kept as " + path.string();
    }
  } catch (const std::exception& fault) {
    return fault.what();
  }
}

ExploreSettings window_settings(const protocols::SceneSpec& spec,
                                const rendering::Renderer& renderer,
                                const HandsOnSettings& settings) {
  SceneDrawing drawing(spec.objects, tool_of(spec.tool));
  const rendering::Scene scene = build_scene(settings.scene_path, spec, renderer);
  for (const std::string& note : scene_notes(spec, scene))
    std::cerr << printable(settings.scene_path) << ": " << note << '\n';
  drawing.add_compiled(scene);
  ExploreSettings out{.title = fs::path(settings.scene_path).filename().string(),
                      .objects = spec.objects,
                      .drawing = std::move(drawing),
                      .looks = {.sides = renderer.side_contact(), .labels = settings.labels}};
  if (!settings.pictures.empty())
    out.keep_picture = [folder = settings.pictures](const std::string& bytes, const char* kind) {
      return keep_in(folder, bytes, kind);
    };
  return out;
}

/// Signals that end the program command zero force while this lives.
class WatchedForces {
 public:
  WatchedForces(FaultSignals& signals, ServoThread& servo) : signals_(signals) {
    signals_.watch(&servo);
  }
  WatchedForces(const WatchedForces&) = delete;
  WatchedForces& operator=(const WatchedForces&) = delete;
  ~WatchedForces() {
    signals_.watch(static_cast<ServoThread*>(nullptr));
    signals_.watch(static_cast<GuardedDevice*>(nullptr));
  }

 private:
  FaultSignals& signals_;
};

int explore_live(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                 const HandsOnSettings& settings) {
  protocols::Protocol protocol = protocol_of(spec, renderer);
  protocol.material_limit = protocols::MaterialLimit::limit;
  RunSettings run;
  run.device = settings.device;
  run.calibration = settings.calibration;
  run.without_calibration = settings.without_calibration;
  const DeviceKind& kind = find_device_kind(settings.device);
  ExploreSettings window = window_settings(spec, renderer, settings);
  FaultSignals signals;
  const OpenDevice open = open_device(kind, run, protocol);
  signals.watch(open.guard);
  const DeviceCapabilities& device = open.device->capabilities();
  if (open.guard != nullptr) check_fitness(open, run, protocol, StimulusLibrary(protocol));
  RealClock clock;
  ServoSettings servo;
  servo.rate = protocol.servo_rate;
  servo.workspace = workspace_of(protocol);
  window.mouse = dynamic_cast<MouseStylus*>(open.device.get());
  window.workspace = servo.workspace;
  window.end_requested = [&signals] { return signals.end_requested() != 0; };
  const auto limit = [&](std::vector<stimuli::ObjectSpec>& objects) {
    protocols::Protocol limited = protocol;
    for (std::size_t i = 0; i < objects.size(); ++i) limited.stimuli[i].object = objects[i];
    for (const LimitedMaterial& what : limit_materials(limited, device))
      std::fprintf(stderr, "%s\n", printable(what.text).c_str());
    for (std::size_t i = 0; i < objects.size(); ++i) objects[i] = limited.stimuli[i].object;
  };
  LiveTouch touch(*open.device, clock,
                  {.scene_path = settings.scene_path,
                   .spec = spec,
                   .renderer = &renderer,
                   .servo = servo,
                   .limit = limit,
                   .emergency = [guard = open.guard] {
                     if (guard != nullptr) guard->emergency_zero();
                   }});
  const WatchedForces watched(signals, touch.servo());
  explore_in_window(std::move(window), touch);
  const ServoHealth& health = touch.servo().health();
  std::cout << health.ticks() << " ticks, " << health.missed_ticks() << " missed, "
            << health.lost_samples() << " not shown\n";
  return 0;
}

}  // namespace

int explore_hands_on(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                     const HandsOnSettings& settings) {
  if (settings.trajectory.empty()) return explore_live(spec, renderer, settings);
  RecordedTouch touch(settings.scene_path, spec, renderer, read_trajectory(settings.trajectory));
  ExploreSettings window = window_settings(spec, renderer, settings);
  window.end_requested = [&stop = catch_stop_signals()] { return stop.load(); };
  explore_in_window(std::move(window), touch);
  return 0;
}

}  // namespace palpate::runner
