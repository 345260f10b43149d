// A live session: a person, a device, two displays, and nothing lost.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <thread>

#include "data/checks.h"
#include "data/utc.h"
#include "protocols/parse.h"
#include "runner/build_info.h"
#include "runner/commands/command.h"
#include "runner/device_check.h"
#include "runner/devices/registry.h"
#include "runner/display/text_display.h"
#include "runner/fault_signals.h"
#include "runner/live_session.h"
#include "runner/preflight.h"

namespace palpate {
namespace {

namespace po = boost::program_options;

struct RunSettings {
  std::string protocol, database, participant, device;
  std::optional<int> number, session;
  std::string consent, hand, firmware, calibration, sound_device = "default";
  std::vector<std::string> serials, markers;
  std::optional<double> response_latency;
  int participant_monitor = 0, console_monitor = 0;
  bool no_window = false, full_screen = false, buttons = false, without_calibration = false,
       without_noise = false;
};

/// Stands for a device whether it is in this process or in a guard's.
struct OpenDevice {
  std::unique_ptr<Device> device;
  GuardedDevice* guard = nullptr;  ///< the same, where there is one
};

void check(const RunSettings& settings) {
  if (!is_participant_code(settings.participant))
    throw UsageError("--participant: a pseudonym of 1 to 32 letters and digits was expected");
  if (settings.number && *settings.number < 1) throw UsageError("--number: 1 or more was expected");
  if (settings.session && *settings.session < 1)
    throw UsageError("--session: 1 or more was expected");
  if (!settings.hand.empty() && settings.hand != "left" && settings.hand != "right")
    throw UsageError("--hand: left or right was expected");
  if (settings.response_latency &&
      !(std::isfinite(*settings.response_latency) && *settings.response_latency >= 0))
    throw UsageError("--response-latency: seconds, 0 or more, were expected");
  if (settings.device == "mouse" && settings.no_window)
    throw UsageError("--device mouse needs the window: leave out --no-window");
}

const DeviceKind& kind_of(const std::string& name) {
  try {
    return device_kind(name);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--device: ") + error.what());
  }
}

OpenDevice open_device(const DeviceKind& kind, const RunSettings& settings,
                       const Protocol& protocol) {
  const DeviceOrder order{protocol.servo_rate, protocol.stylus.length, protocol.stylus.grip,
                          settings.serials,    settings.firmware,      settings.calibration};
  if (!kind.pushes) return {kind.open(order), nullptr};
  GuardSettings guard;
  guard.rate = protocol.servo_rate;
  auto guarded = std::make_unique<GuardedDevice>([&] { return kind.open(order); }, guard);
  GuardedDevice* const itself = guarded.get();
  return {std::move(guarded), itself};
}

/// \throws UsageError where the device cannot or should not show the protocol.
void check_fitness(const DeviceKind& kind, const Device& device, const RunSettings& settings,
                   const Protocol& protocol, const StimulusLibrary& library) {
  const DeviceCapabilities& able = device.capabilities();
  std::string reasons;
  for (const std::string& misfit : misfits(protocol, library, able)) {
    reasons += "\n";
    reasons += misfit;
  }
  if (!reasons.empty()) throw UsageError("this protocol cannot be run with this device:" + reasons);
  if (settings.buttons && protocol.response.keys.size() > 8)
    throw UsageError("--buttons: a device has 8 buttons at most; the protocol has " +
                     std::to_string(protocol.response.keys.size()) + " answers");
  const bool stale = able.calibration.rfind("stale", 0) == 0;
  if (!kind.pushes || settings.without_calibration || (!able.calibration.empty() && !stale)) return;
  throw UsageError("the calibration of '" + settings.device + "' is " +
                   (stale ? able.calibration : "missing") +
                   "\n'palpate devices --calibrate' makes one, --calibration names its file, "
                   "--without-calibration runs the session without");
}

std::vector<std::unique_ptr<MarkerSink>> open_markers(const std::vector<std::string>& names) {
  std::vector<std::unique_ptr<MarkerSink>> sinks;
  for (const std::string& name : names) {
    try {
      sinks.push_back(open_marker_sink(name));
    } catch (const std::invalid_argument& error) {
      throw UsageError(std::string("--markers: ") + error.what());
    }
  }
  return sinks;
}

/// None where the protocol wants none, or the experimenter. \throws SoundError
std::unique_ptr<NoisePlayer> open_noise(const RunSettings& settings, const Protocol& protocol) {
  if (!protocol.masking_noise || settings.without_noise) return nullptr;
  return std::make_unique<NoisePlayer>(*protocol.masking_noise, protocol.seed,
                                       settings.sound_device);
}

ClockStamp stamp_now(Clock& clock) {
  const std::int64_t before = clock.now_ns();
  const std::int64_t utc =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  return {utc, before + (clock.now_ns() - before) / 2};
}

/// Which session is due.
int choose_session(Store& store, const Participant& participant, const Protocol& protocol,
                   const RunSettings& settings, std::int64_t utc_ns) {
  const int count = protocol.sessions.count;
  if (settings.session && *settings.session > count)
    throw UsageError("--session: the protocol has " + std::to_string(count));
  int session = 1;
  SessionProgress before;
  for (; session <= count; ++session) {
    const SessionProgress progress = store.progress(participant, session);
    if (progress.last_end != RunEnd::done) break;
    before = progress;
  }
  if (settings.session) {
    if (*settings.session > session)
      std::fprintf(stderr, "session %d is not finished; session %d was asked for\n", session,
                   *settings.session);
    return *settings.session;
  }
  if (session > count)
    throw UsageError("participant " + participant.code + " has done every session");
  const std::string day = format_utc(before.clock.utc_ns).substr(0, 10);
  if (session > 1 && day == format_utc(utc_ns).substr(0, 10))
    std::fprintf(stderr, "session %d was today as well\n", session - 1);
  return session;
}

RunInfo describe(const RunSettings& settings, const DeviceCapabilities& device, int session,
                 const ClockStamp& stamp) {
  RunInfo info;
  info.session = session;
  info.clock = stamp;
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = settings.device;
  info.device_calibration = device.calibration;
  if (!device.serial.empty()) info.device_calibration += " (serial " + device.serial + ")";
  info.response_device = settings.buttons ? "device buttons" : "keyboard";
  info.response_latency = settings.response_latency;
  info.consent_version = settings.consent;
  if (!settings.consent.empty()) info.consent_utc_ns = stamp.utc_ns;
  info.hand = settings.hand;
  return info;
}

std::unique_ptr<DisplayLoop> open_display(const RunSettings& settings, const Protocol& protocol,
                                          Clock& clock, Device& device,
                                          const std::function<void()>& emergency) {
  if (!settings.no_window) {
    WindowSettings window;
    window.title = protocol.name + ", " + settings.participant;
    window.full_screen = settings.full_screen;
    window.participant_monitor = settings.participant_monitor;
    window.console_monitor = settings.console_monitor;
    const auto& texts = protocol.texts;
    window.texts = {texts.instructions, texts.practice, texts.break_text, texts.end};
    for (const auto& [key, name] : protocol.response.keys) window.texts.push_back(name);
    window.emergency = emergency;
    window.mouse = dynamic_cast<MouseStylus*>(&device);
    window.workspace = {protocol.workspace.centre, protocol.workspace.scale};
    window.clock = &clock;
    try {
      auto windows = make_windows(window);
      const std::string missing = missing_letters(window.texts);
      if (!missing.empty()) std::fprintf(stderr, "%s\n", missing.c_str());
      return windows;
    } catch (const DisplayError& error) {
      if (window.mouse != nullptr) throw;
      std::fprintf(stderr, "%s; a text display instead\n", error.what());
    }
  }
  return make_text_display({&clock, emergency});
}

/// What the session's thread does; all that it needs is owned by the main thread.
struct Station {
  const RunSettings& settings;
  const Protocol& protocol;
  const StimulusLibrary& library;
  const DeviceKind& kind;
  GuardedDevice* guard;
  const DeviceCapabilities& device;
  ServoThread& servo;
  Clock& clock;
  Store& store;
  DisplayLoop& display;
  Markers& markers;
  FaultSignals& signals;
  Participant participant;
  int session;
  NoisePlayer* noise;  ///< may be none
  const std::vector<LimitedMaterial>& limited;
  const FeeblePush& push;
};

struct PreflightRecord {
  std::vector<std::string> findings;
  std::vector<std::string> messages;  ///< that the console has shown
};

/// \throws EndOfSession
PreflightRecord go_through_preflight(const Station& at) {
  PreflightNeeds needs;
  if (at.kind.pushes) {
    for (std::size_t i = 0; i < at.protocol.stimuli.size(); ++i)
      needs.reach = std::max(needs.reach, at.library.reach(static_cast<int>(i)));
    needs.push = &at.push;
    needs.device_limit = at.device.max_force;
    if (at.settings.buttons) needs.buttons = static_cast<int>(at.protocol.response.keys.size());
  }
  Preflight preflight(needs);
  ConsoleState state;
  state.study = at.protocol.name;
  state.participant = at.participant.code;
  state.session = at.session;
  state.state = "pre-flight";
  for (const LimitedMaterial& one : at.limited) state.messages.push_back(one.text);
  std::string told;
  std::int64_t told_ns = at.clock.now_ns() - 500'000'000;  // what is well need not be said
  std::int64_t pushed_ns = 0;
  while (preflight.step() != Preflight::Step::done) {
    at.clock.wait_until(at.clock.now_ns() + 5'000'000);
    if (at.servo.latest(state.sample)) preflight.add(state.sample);
    for (const ConsoleCommand& command : at.display.console().commands()) {
      // What was pressed while it pushed does not tell that it was felt.
      if (command.kind == ConsoleCommand::Kind::go_on && command.time_ns >= pushed_ns)
        preflight.skip();
      if (command.kind == ConsoleCommand::Kind::repeat_trial) preflight.repeat();
      if (command.kind == ConsoleCommand::Kind::quit)
        throw EndOfSession(RunEnd::aborted, "ended by the experimenter");
    }
    if (at.signals.end_requested() != 0)
      throw EndOfSession(RunEnd::aborted, "a signal asked for the end", true);
    if (!at.display.participant().open())
      throw EndOfSession(RunEnd::aborted, "the participant's screen was closed", true);
    if (preflight.push_due()) {
      at.servo.clear_fault();  // before homing there were no readings
      preflight.pushed(at.push.give(at.servo, [&] { return at.signals.end_requested() != 0; }));
      pushed_ns = at.clock.now_ns();
    }
    const std::string instruction = preflight.instruction();
    const std::int64_t now = at.clock.now_ns();
    // What is missing changes while the stylus moves: no more often than one can read.
    if (instruction != told && now - told_ns > 1'000'000'000) {
      told = instruction;
      told_ns = now;
      state.messages.push_back(instruction);
    }
    at.display.console().show(state);
  }
  at.servo.clear_fault();  // before homing there were no readings
  at.display.console().show(state);
  return {preflight.findings(), state.messages};
}

SessionPlan plan_of(const Station& at, const SessionProgress& before) {
  SessionPlan plan(at.protocol, at.participant.number, at.session);
  for (const TrialRecord& record : before.completed) plan.answered(record.correct);
  return plan;
}

LiveSession::Outcome run_session(const Station& at) {
  const PreflightRecord preflight = go_through_preflight(at);
  const SessionPlan plan = plan_of(at, at.store.progress(at.participant, at.session));
  const ClockStamp stamp = stamp_now(at.clock);
  const Run run =
      at.store.begin_run(at.participant, describe(at.settings, at.device, at.session, stamp));
  LiveSession session(
      {at.protocol, at.library, at.servo, at.guard, at.clock, at.store, at.display.participant(),
       at.display.console(), at.markers, at.settings.buttons ? AnswerBy::buttons : AnswerBy::keys,
       [&at] { return at.signals.end_requested(); }, at.noise},
      at.participant, run, stamp, plan);
  for (const std::string& message : preflight.messages) session.say(message);  // it shows on
  if (at.kind.pushes) {
    std::string text = "pre-flight: ";
    for (const std::string& finding : preflight.findings) text += finding + "; ";
    at.store.add_note(
        run, stamp.monotonic_ns,
        text + (at.settings.without_calibration ? "WITHOUT calibration" : "calibration stored"));
  }
  if (!at.limited.empty()) {
    at.store.add_note(run, stamp.monotonic_ns,
                      to_json_text(at.limited, at.device, at.protocol.servo_rate));
  }
  if (at.protocol.masking_noise && at.noise == nullptr) {
    session.say("WITHOUT the protocol's masking noise");
    at.store.add_note(run, stamp.monotonic_ns, R"({"masking_noise":"left out"})");
  }
  const std::string& missing = at.servo.rights().missing;
  if (!missing.empty()) session.say(missing);
  return session.run();
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

void report_servo(const Station& at, std::int64_t started_ns) {
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
int report(const Station& at, const LiveSession::Outcome& outcome) {
  std::printf("%s, participant %s (number %d), session %d: %zu of %zu trials on record; %s\n",
              at.protocol.name.c_str(), at.participant.code.c_str(), at.participant.number,
              at.session, outcome.recorded, outcome.trials, to_string(outcome.end));
  if (!outcome.reason.empty()) std::fprintf(stderr, "%s\n", outcome.reason.c_str());
  if (outcome.end == RunEnd::paused || outcome.end == RunEnd::aborted)
    std::fprintf(stderr, "the same command goes on from here\n");
  if (at.markers.dropped() > 0)
    std::fprintf(stderr, "%llu markers were not taken by their receivers\n",
                 static_cast<unsigned long long>(at.markers.dropped()));
  return outcome.failed ? 1 : 0;
}

int run_station(const RunSettings& settings) {
  Protocol protocol = parse_protocol(settings.protocol);
  const DeviceKind& kind = kind_of(settings.device);
  Markers markers(open_markers(settings.markers));
  FaultSignals signals;
  const OpenDevice open = open_device(kind, settings, protocol);
  const Watch guard_watch(signals, open.guard);
  const DeviceCapabilities& able = open.device->capabilities();
  const std::vector<LimitedMaterial> limited = limit_materials(protocol, able);
  const StimulusLibrary library(protocol);
  check_fitness(kind, *open.device, settings, protocol, library);
  const auto noise = open_noise(settings, protocol);  // after the guard's fork: it has a thread

  Store store = Store::open(settings.database, Store::Mode::write_or_create);
  RealClock clock;
  // What a simulated device gave is labelled simulated, whoever answered.
  const Participant participant =
      store.enrol({protocol.name, protocol.source_text, protocol.sha256}, settings.participant,
                  settings.number, able.simulated);
  const int session =
      choose_session(store, participant, protocol, settings, stamp_now(clock).utc_ns);
  std::printf("participant %s has number %d; session %d of %d\n", participant.code.c_str(),
              participant.number, session, protocol.sessions.count);
  std::fflush(stdout);
  if (able.simulated) std::fprintf(stderr, "SIMULATED device: the data are labelled so\n");
  if (settings.consent.empty())
    std::fprintf(stderr, "no consent is recorded (--consent VERSION)\n");

  ServoSettings servo_settings;
  servo_settings.rate = protocol.servo_rate;
  servo_settings.workspace = {protocol.workspace.centre, protocol.workspace.scale};
  servo_settings.passivity_controller = protocol.passivity_controller;
  ForceLimits limits = servo_settings.limits;
  limits.max_force = std::min(limits.max_force, able.max_force);
  const FeeblePush push(limits, able.sensed_freedom >= 5);
  const std::int64_t started_ns = clock.now_ns();
  ServoThread servo(*open.device, clock, servo_settings);
  const Watch servo_watch(signals, &servo);
  const auto emergency = [&servo, guard = open.guard] {
    if (guard != nullptr) guard->emergency_zero();
    servo.emergency_zero();
  };
  const auto display = open_display(settings, protocol, clock, *open.device, emergency);
  const Station station{settings,    protocol, library,     kind,     open.guard, able,
                        servo,       clock,    store,       *display, markers,    signals,
                        participant, session,  noise.get(), limited,  push};
  LiveSession::Outcome outcome;
  std::exception_ptr failure;
  std::jthread session_thread([&] {
    try {
      outcome = run_session(station);
    } catch (const EndOfSession& end) {  // before there was anything to record
      outcome = {end.end, end.what(), 0, 0, end.failed};
    } catch (...) {
      emergency();
      failure = std::current_exception();
    }
    display->end();
  });
  display->run();
  session_thread.join();
  report_servo(station, started_ns);
  if (failure) std::rethrow_exception(failure);
  return report(station, outcome);
}

}  // namespace

int run_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate run PROTOCOL.json --db FILE --participant CODE [--number N] --device NAME";
  line.summary =
      "A live session: resumes an unfinished one, else begins the next. Every trial is on disk "
      "before\nthe next one starts. The participant answers with the protocol's keys; Escape or "
      "F12 turns the\nforces off. 'palpate devices' lists the devices.";
  line.example =
      "  palpate run protocols/ho2000.json --db study.db --participant P03 --device falcon2 "
      "--hand right --consent 2024-05\n"
      "  palpate run protocols/quick.json --db try.db --participant T1 --device mouse\n"
      "  palpate run protocols/quick.json --db try.db --participant T2 --device simulated "
      "--no-window\n";
  RunSettings settings;
  int number = 0, session = 0;
  double latency = 0;
  line.options.add_options()  //
      ("db", po::value(&settings.database)->required()->value_name("FILE"),
       "database; created, or gone on with")  //
      ("participant", po::value(&settings.participant)->required()->value_name("CODE"),
       "pseudonym, 1 to 32 letters and digits")  //
      ("number", po::value(&number)->value_name("N"),
       "orders the counterbalancing; default: the next unused one")  //
      ("device", po::value(&settings.device)->required()->value_name("NAME"),
       "falcon, falcon2, mouse or simulated")  //
      ("session", po::value(&session)->value_name("N"),
       "default: the first that is not done")  //
      ("consent", po::value(&settings.consent)->value_name("VERSION"),
       "the consent that was given: version of its text; recorded with the time")           //
      ("hand", po::value(&settings.hand)->value_name("left|right"), "hand used; recorded")  //
      ("buttons", po::bool_switch(&settings.buttons),
       "the device's buttons answer, in the order of the protocol's keys")  //
      ("response-latency", po::value(&latency)->value_name("SECONDS"),
       "of keyboard or buttons, where it was measured; recorded, never subtracted")  //
      ("markers", po::value(&settings.markers)->composing()->value_name("WHERE"),
       "udp:HOST:PORT, serial:PATH[:BAUD] or lsl[:NAME]; may be given several times")      //
      ("no-window", po::bool_switch(&settings.no_window), "text only")                     //
      ("full-screen", po::bool_switch(&settings.full_screen), "the participant's window")  //
      ("participant-monitor", po::value(&settings.participant_monitor)->value_name("N"),
       "from 1")                                                                            //
      ("console-monitor", po::value(&settings.console_monitor)->value_name("N"), "from 1")  //
      ("serial", po::value(&settings.serials)->composing()->value_name("NUMBER"),
       "which device; falcon2: twice, tip first")  //
      ("firmware", po::value(&settings.firmware)->value_name("FILE"),
       "uploaded where the device needs it")  //
      ("calibration", po::value(&settings.calibration)->value_name("FILE"),
       "what 'palpate devices --calibrate' stored")  //
      ("without-calibration", po::bool_switch(&settings.without_calibration),
       "run although the calibration is missing or stale")  //
      ("sound-device", po::value(&settings.sound_device)->value_name("NAME"),
       "ALSA device of the headphones, where the protocol has masking noise; default: default")  //
      ("without-noise", po::bool_switch(&settings.without_noise),
       "run without the protocol's masking noise");
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return 0;
  settings.protocol = (*values)["PROTOCOL.json"].as<std::string>();
  if (values->count("number") > 0) settings.number = number;
  if (values->count("session") > 0) settings.session = session;
  if (values->count("response-latency") > 0) settings.response_latency = latency;
  check(settings);
  std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away does not end a session
  return run_station(settings);
}

}  // namespace palpate
