#include "runner/commands/run/station.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runner/commands/run/session.h"
#include "runner/commands/shared/command.h"
#include "runner/display/text_display.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

constexpr const char* kNotEnrolledYet =
    "the participant is enrolled, and the number taken, when the first trial begins\n";

/// Stands for a device whether it is in this process or in a guard's.
struct OpenDevice {
  std::unique_ptr<Device> device;
  GuardedDevice* guard = nullptr;  ///< the same, where there is one
};

const DeviceKind& kind_of(const std::string& name) {
  try {
    return device_kind(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--device: ") + error.what());
  }
}

OpenDevice open_device(const DeviceKind& kind, const RunSettings& settings,
                       const protocols::Protocol& protocol) {
  const DeviceConfig config{protocol.servo_rate, protocol.stylus.length, protocol.stylus.grip,
                            settings.serials,    settings.firmware,      settings.calibration};
  try {
    kind.check(config);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--serial: ") + error.what());
  }
  if (!kind.has_force_feedback) return {kind.open(config), nullptr};
  GuardSettings guard;
  guard.rate = protocol.servo_rate;
  auto guarded = std::make_unique<GuardedDevice>([&] { return kind.open(config); }, guard);
  GuardedDevice* const itself = guarded.get();
  return {std::move(guarded), itself};
}

/// \throws UsageError where the device cannot or should not show the protocol.
void check_fitness(const DeviceKind& kind, const Device& device, const RunSettings& settings,
                   const protocols::Protocol& protocol, const StimulusLibrary& library) {
  const DeviceCapabilities& able = device.capabilities();
  std::string reasons;
  for (const std::string& misfit : incompatibilities(protocol, library, able)) {
    reasons += "\n";
    reasons += misfit;
  }
  if (!reasons.empty()) throw UsageError("this protocol cannot be run with this device:" + reasons);
  if (settings.buttons && protocol.response.keys.size() > 8)
    throw UsageError("--buttons: a device has 8 buttons at most; the protocol has " +
                     std::to_string(protocol.response.keys.size()) + " answers");
  const bool unfit =
      able.calibration.rfind("stale", 0) == 0 || able.calibration.rfind("implausible", 0) == 0;
  if (!kind.has_force_feedback || settings.without_calibration ||
      (!able.calibration.empty() && !unfit))
    return;
  throw UsageError("the calibration of '" + settings.device + "' is " +
                   (unfit ? able.calibration : "missing") +
                   "\n'palpate devices --calibrate' makes one, --calibration names its file, "
                   "--without-calibration runs the session without");
}

std::vector<std::unique_ptr<MarkerSink>> open_markers(const std::vector<std::string>& names,
                                                      MarkerCodes codes) {
  std::vector<std::unique_ptr<MarkerSink>> sinks;
  for (const std::string& name : names) {
    try {
      sinks.push_back(open_marker_sink(name, codes));
    } catch (const std::invalid_argument& error) {
      throw UsageError(std::string("--markers: ") + error.what());
    }
  }
  return sinks;
}

/// None where the protocol wants none, or the experimenter. \throws SoundError
std::unique_ptr<NoisePlayer> open_noise(const RunSettings& settings,
                                        const protocols::Protocol& protocol) {
  if (!protocol.masking_noise || settings.without_noise) return nullptr;
  return std::make_unique<NoisePlayer>(*protocol.masking_noise, protocol.seed,
                                       settings.sound_device);
}

std::unique_ptr<DisplayLoop> open_display(const RunSettings& settings,
                                          const protocols::Protocol& protocol, Clock& clock,
                                          Device& device, const std::function<void()>& emergency) {
  if (!settings.no_window) {
    WindowSettings window;
    window.title = protocol.name + ", " + settings.participant;
    window.full_screen = settings.full_screen;
    window.ui_scale = settings.ui_scale;
    window.participant_monitor = settings.participant_monitor;
    window.console_monitor = settings.console_monitor;
    const auto& texts = protocol.texts;
    window.texts = {texts.instructions, texts.practice,  texts.break_text,
                    texts.end,          texts.move_away, texts.ready,
                    texts.go,           texts.wait,      texts.other_key};
    for (const auto& [key, name] : protocol.response.keys)
      window.texts.push_back(protocols::answer_label(protocol, name));
    window.emergency = emergency;
    window.mouse = dynamic_cast<MouseStylus*>(&device);
    window.workspace = {protocol.workspace.centre, protocol.workspace.scale};
    window.clock = &clock;
    try {
      auto windows = make_windows(window);
      const std::string missing = windows->unreadable();
      if (!missing.empty()) std::fprintf(stderr, "%s\n", stimuli::printable_lines(missing).c_str());
      const std::string warning = windows->warning();
      if (!warning.empty()) std::fprintf(stderr, "%s\n", warning.c_str());
      return windows;
    } catch (const DisplayError& error) {
      if (window.mouse != nullptr) throw;
      std::fprintf(stderr, "%s; a text display instead\n",
                   stimuli::printable(error.what()).c_str());
    }
  }
  return make_text_display({&clock, emergency});
}

/// While it lives, signals turn these forces off.
template <class Forces>
class Watch {
 public:
  Watch(FaultSignals& signals, Forces* forces) : signals_(signals) { signals_.watch(forces); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch() { signals_.watch(static_cast<Forces*>(nullptr)); }

 private:
  FaultSignals& signals_;
};

void report_servo(const RunParts& at, std::int64_t started_ns) {
  const ServoHealth& health = at.servo.health();
  const double elapsed = static_cast<double>(at.clock.now_ns() - started_ns) * 1e-9;
  std::fprintf(stderr,
               "servo: %llu ticks in %.3f s, %llu missed, longest period %.2f ms, lateness p99.9 "
               "%.0f us\n",
               static_cast<unsigned long long>(health.ticks()), elapsed,
               static_cast<unsigned long long>(health.missed_ticks()),
               static_cast<double>(health.longest_period_ns()) * 1e-6,
               static_cast<double>(health.lateness().quantile(0.999)) * 1e-3);
}

/// \return the exit status
int report(const RunParts& at, const LiveSession::Outcome& outcome) {
  const data::Participant who = at.store.look_up(at.admission.enrolled, at.participant.code,
                                                 std::nullopt, at.participant.simulated);
  const std::string number = who.id == 0 ? "not enrolled" : "number " + std::to_string(who.number);
  std::printf("%s, participant %s (%s), session %d: %zu of %zu trials on record; %s\n",
              at.protocol.name.c_str(), who.code.c_str(), number.c_str(), at.session,
              outcome.recorded, outcome.trials, data::to_string(outcome.end));
  for (const std::string& note : outcome.unkept)
    std::fprintf(stderr, "not on record, as nobody was enrolled: %s\n",
                 stimuli::printable_lines(note).c_str());
  if (!outcome.reason.empty())
    std::fprintf(stderr, "%s\n", stimuli::printable_lines(outcome.reason).c_str());
  if (outcome.end == data::RunEnd::paused || outcome.end == data::RunEnd::aborted)
    std::fprintf(stderr, "the same command goes on from here\n");
  if (at.markers.dropped() > 0)
    std::fprintf(stderr, "%llu markers were not taken by their receivers\n",
                 static_cast<unsigned long long>(at.markers.dropped()));
  return outcome.failed ? 1 : 0;
}

}  // namespace

int run_station(const RunSettings& named) {
  const DeviceKind& kind = kind_of(named.device);
  Admission admission = admit(named);
  RunSettings settings = named;
  settings.participant = admission.participant;
  protocols::Protocol& protocol = admission.protocol;
  Markers markers(open_markers(settings.markers, settings.marker_codes
                                                     ? MarkerCodes::everywhere
                                                     : MarkerCodes::this_computer));
  FaultSignals signals;
  const OpenDevice open = open_device(kind, settings, protocol);
  const Watch guard_watch(signals, open.guard);
  const DeviceCapabilities& able = open.device->capabilities();
  const std::vector<LimitedMaterial> limited = limit_materials(protocol, able);
  const StimulusLibrary library(protocol);
  check_fitness(kind, *open.device, settings, protocol, library);
  const auto noise = open_noise(settings, protocol);  // after the guard's fork: it has a thread

  data::Store store = data::Store::open(settings.database, data::Store::Mode::write_or_create);
  warn_of_exposure(store.path());
  RealClock clock;
  // What a simulated device gave is labelled simulated, whoever answered.
  const data::Participant participant =
      store.look_up(admission.enrolled, settings.participant, admission.number, able.simulated);
  const int session = choose_session(store, participant, protocol, settings, clock);
  std::printf("participant %s has number %d; session %d of %d\n", participant.code.c_str(),
              participant.number, session, protocol.sessions.count);
  std::fflush(stdout);
  if (participant.enrolled_number != participant.number)
    std::fprintf(stderr,
                 "renumbered when databases were merged: the trials are those of number %d\n",
                 participant.enrolled_number);
  if (participant.id == 0) std::fprintf(stderr, "%s", kNotEnrolledYet);
  if (able.simulated) std::fprintf(stderr, "SIMULATED device: the data are labelled so\n");
  if (settings.consent.empty())
    std::fprintf(stderr, "no consent is recorded (--consent VERSION)\n");

  ServoSettings servo_settings;
  servo_settings.rate = protocol.servo_rate;
  servo_settings.workspace = {protocol.workspace.centre, protocol.workspace.scale};
  servo_settings.passivity_controller = protocol.passivity_controller;
  ForceLimits limits = servo_settings.limits;
  limits.max_force = std::min(limits.max_force, able.max_force);
  const ForceDirectionCheck push(limits, able.sensed_freedom >= 5);
  const std::int64_t started_ns = clock.now_ns();
  ServoThread servo(*open.device, clock, servo_settings);
  const Watch servo_watch(signals, &servo);
  const auto emergency = [&servo, guard = open.guard] {
    if (guard != nullptr) guard->emergency_zero();
    servo.emergency_zero();
  };
  const auto display = open_display(settings, protocol, clock, *open.device, emergency);
  const RunParts parts{settings,    protocol, library,   kind,        open.guard, able,
                       servo,       clock,    store,     *display,    markers,    signals,
                       participant, session,  admission, noise.get(), limited,    push};
  LiveSession::Outcome outcome;
  std::exception_ptr failure, display_failure;
  std::jthread session_thread([&] {
    try {
      outcome = run_session(parts);
    } catch (const EndOfSession& end) {  // before there was anything to record
      outcome = {end.end, end.what(), 0, 0, end.failed};
    } catch (...) {
      emergency();
      failure = std::current_exception();
    }
    display->end();
  });
  try {
    display->run();
  } catch (...) {  // the session ends by itself: its participant sees nothing
    emergency();
    display_failure = std::current_exception();
  }
  session_thread.join();
  report_servo(parts, started_ns);
  if (failure) std::rethrow_exception(failure);
  if (display_failure) std::rethrow_exception(display_failure);
  return report(parts, outcome);
}

}  // namespace palpate::runner
