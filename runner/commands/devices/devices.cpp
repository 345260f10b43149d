// palpate devices: connected devices, their limits and self-tests; the servo's timing on this
// computer; calibration.

#include "runner/commands/devices/devices.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "data/files/atomic_file.h"
#include "data/files/utc.h"
#include "runner/commands/shared/command.h"
#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"
#include "runner/devices/self_test.h"
#include "runner/output/outputs.h"
#include "runner/session/markers.h"
#include "runner/station/opening.h"
#include "runner/station/servo_timing.h"

namespace palpate::runner::commands {
namespace {

using station::ServoTiming;

namespace po = boost::program_options;
using Json = nlohmann::ordered_json;

Json to_json(const servo::DeviceCapabilities& c) {
  // Without motors there are no limits of force; the stored ones only keep scenes from being
  // limited.
  const auto limit_of_force = [&c](double limit) {
    return c.actuated_freedom > 0 ? Json(limit) : Json();
  };
  return {{"sensed_freedom", c.sensed_freedom},
          {"actuated_freedom", c.actuated_freedom},
          {"max_force_n", limit_of_force(c.max_force)},
          {"max_torque_nm", c.max_torque > 0 ? Json(c.max_torque) : Json()},
          {"max_stiffness_n_per_m", limit_of_force(c.max_stiffness)},
          {"max_rate_hz", c.any_rate ? Json() : Json(c.max_rate)},
          {"workspace_radius_m", c.workspace_radius},
          {"resolution_m", c.resolution},
          {"damping_ns_per_m", c.damping},
          {"friction_n", c.friction},
          {"simulated", c.simulated},
          {"serial", c.serial},
          {"calibration", c.calibration}};
}

void print_limits(const servo::DeviceCapabilities& c) {
  std::string rate = "at any rate that is asked for";
  if (!c.any_rate) rate = "up to " + std::to_string(std::lround(c.max_rate)) + " Hz";
  std::printf("    senses %d degrees of freedom, ", c.sensed_freedom);
  if (c.actuated_freedom > 0) {
    std::printf("drives %d; up to %g N, %g N/m, %s;\n", c.actuated_freedom, c.max_force,
                c.max_stiffness, rate.c_str());
  } else {
    std::printf("drives none: nothing is felt; %s;\n", rate.c_str());
  }
  std::printf("    reaches %g mm about its centre, resolves %g um\n", c.workspace_radius * 1e3,
              c.resolution * 1e6);
  if (!c.serial.empty()) std::printf("    serial number %s\n", printable(c.serial).c_str());
  if (!c.calibration.empty())
    std::printf("    calibration: %s\n", printable(c.calibration).c_str());
}

/// Opens a device, prints its limits and self-test. \return whether the test was passed
bool open_and_test(const devices::DeviceKind& kind, const servo::DeviceConfig& config, Json& row) {
  const auto factory = [&kind, config] { return kind.open(config); };
  safety::GuardSettings settings;
  settings.rate = config.rate;
  const std::unique_ptr<servo::Device> device =
      kind.has_force_feedback ? std::make_unique<safety::GuardedDevice>(factory, settings)
                              : factory();
  row["limits"] = to_json(device->capabilities());
  print_limits(device->capabilities());
  bool passed = true;
  row["self_test"] = Json::array();
  for (const devices::SelfTestResult& result : devices::self_test(*device, config.rate)) {
    passed = passed && result.passed;
    row["self_test"].push_back(
        {{"what", result.what}, {"passed", result.passed}, {"found", result.found}});
    std::printf("    %-8s%s: %s\n", result.passed ? "passed" : "FAILED", result.what.c_str(),
                printable(result.found).c_str());
  }
  return passed;
}

/// For a place that is indented by four spaces.
std::string indented(const std::string& text) {
  std::string out;
  for (const char c : printable_lines(text)) {
    out += c;
    if (c == '\n') out += "    ";
  }
  return out;
}

/// Prints the connected devices of a kind. \return false if one that is connected does not work
bool list_kind(const devices::DeviceKind& kind, const servo::DeviceConfig& config, bool named,
               Json& rows) {
  Json row = {{"name", kind.name}, {"description", kind.description}};
  std::printf("%s: %s\n", kind.name, kind.description);
  if (kind.has_force_feedback) std::printf("    not tried on hardware, only with an emulator\n");
  bool good = true, usable = false;
  row["connected"] = Json::array();
  try {
    const std::vector<servo::ConnectedDevice> connected = devices::list_connected(kind, config);
    for (const servo::ConnectedDevice& found : connected) {
      row["connected"].push_back({{"serial", found.serial}, {"trouble", found.trouble}});
      usable = usable || found.trouble.empty();
      if (!found.serial.empty())
        std::printf("    connected: %s\n", printable(found.serial).c_str());
      if (!found.trouble.empty())
        std::printf("    cannot be used: %s\n", indented(found.trouble).c_str());
    }
    if (connected.empty()) std::printf("    none connected\n");
    if (kind.has_force_feedback && !named) {
      if (usable)
        std::printf("    --device %s opens it: limits and self-test (nothing is pushed)\n",
                    kind.name);
    } else {
      good = open_and_test(kind, config, row);
    }
  } catch (const std::runtime_error& error) {
    row["trouble"] = error.what();
    std::printf("    %s\n", indented(error.what()).c_str());
    good = !named;
  }
  rows.push_back(std::move(row));
  return good;
}

Json to_json(const ServoTiming& t) {
  static constexpr const char* kVerdicts[] = {"fit", "fit_with_losses", "unfit"};
  return {
      {"rate_hz", t.rate},
      {"ticks", t.ticks},
      {"missed_ticks", t.missed_ticks},
      {"missed_in_a_row", t.worst_run},
      {"forces_cut_off", t.trips},
      {"old_readings", t.old_readings},
      {"lateness_ns",
       {{"median", t.lateness_median},
        {"p99", t.lateness_p99},
        {"p99.9", t.lateness_p999},
        {"max", t.lateness_max},
        {"share_above_one_period", t.late_fraction}}},
      {"warm_up_ns",
       {{"median", t.warm_up_median}, {"p99.9", t.warm_up_p999}, {"max", t.warm_up_max}}},
      {"compute_ns", {{"median", t.clock_median}, {"p99.9", t.clock_p999}, {"max", t.clock_max}}},
      {"compute_cpu_ns",
       {{"median", t.compute_median}, {"p99.9", t.compute_p999}, {"max", t.compute_max}}},
      {"asking_cpu_ns", {{"median", t.asking_median}}},
      {"tick_cpu_ns", {{"median", t.tick_median}, {"p99.9", t.tick_p999}, {"max", t.tick_max}}},
      {"rights",
       {{"fifo", t.rights.fifo},
        {"locked_memory", t.rights.locked_memory},
        {"core", t.rights.core},
        {"awake", t.rights.awake},
        {"missing", t.rights.missing}}},
      {"verdict", kVerdicts[static_cast<int>(t.verdict())]},
      {"sentence", t.sentence()}};
}

void print(const ServoTiming& t) {
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) / 1000; };
  std::printf("%-44s%10s%10s%10s%10s\n", "us", "median", "p99", "p99.9", "max");
  std::printf("%-44s%10.1f%10.1f%10.1f%10.1f\n", "lateness of ticks", us(t.lateness_median),
              us(t.lateness_p99), us(t.lateness_p999), us(t.lateness_max));
  std::printf("%-44s%10.2f%10s%10.2f%10.2f\n", "warming the caches up, by the clock",
              us(t.warm_up_median), "", us(t.warm_up_p999), us(t.warm_up_max));
  std::printf("%-44s%10.2f%10s%10.2f%10.2f\n", "rendering and limits, by the clock",
              us(t.clock_median), "", us(t.clock_p999), us(t.clock_max));
  std::printf("%-44s%10.2f%10s%10.2f%10.2f\n", "rendering and limits, thread's own time",
              us(t.compute_median), "", us(t.compute_p999), us(t.compute_max));
  std::printf("%-44s%10.2f\n", "  of which asking for that time", us(t.asking_median));
  std::printf("%-44s%10.2f%10s%10.2f%10.2f\n", "whole tick but the device's transfer",
              us(t.tick_median), "", us(t.tick_p999), us(t.tick_max));
  std::printf("later than a period: %.4g %% of ticks\n%s\n", t.late_fraction * 100,
              t.sentence().c_str());
}

double seconds_of(const po::variables_map& values) {
  const auto seconds = values["seconds"].as<double>();
  if (!(seconds >= 0.1 && seconds <= 86'400)) throw UsageError("--seconds: must be 0.1 to 86400");
  return seconds;
}

int timing(const po::variables_map& values, const servo::DeviceConfig& config, Json& report) {
  station::TimingSettings settings;
  settings.rate = config.rate;
  settings.seconds = seconds_of(values);
  settings.guarded = values.count("guarded") > 0;
  settings.realtime.core = values["core"].as<int>();
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  if (settings.realtime.core < -1 || settings.realtime.core >= cores)
    throw UsageError("--core: this machine has the processors 0 to " + std::to_string(cores - 1));
  if (values.count("no-fifo") > 0) settings.realtime.priority = 0;
  if (values.count("no-realtime") > 0)
    settings.realtime = {0, false, settings.realtime.core, false};
  if (isatty(STDERR_FILENO) != 0)
    std::fprintf(stderr, "Measuring for %g s ...\n", settings.seconds);
  const ServoTiming result = station::measure_servo(settings);
  print(result);
  report["timing"] = to_json(result);
  return result.verdict() == ServoTiming::Verdict::unfit ? 1 : 0;
}

std::string microseconds(std::int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%10.1f", static_cast<double>(ns) / 1000);
  return text;
}

void print(const char* what, const devices::Percentiles& of) {
  std::printf("%-44s%s%s%s%s\n", what, microseconds(of.median).c_str(),
              microseconds(of.p99).c_str(), microseconds(of.p999).c_str(),
              microseconds(of.max).c_str());
}

/// For --report: the delay of a device that can be opened, and this machine's servo.
void add_timing(const devices::DeviceKind* only, const servo::DeviceConfig& config, Json& report) {
  constexpr double kSeconds = 3;
  if (only != nullptr && only->has_force_feedback) {
    try {
      report["chain"] = devices::to_json(station::measure_chain(*only, config, kSeconds));
    } catch (const std::runtime_error& error) {
      report["chain"] = {{"trouble", error.what()}};
    }
  }
  station::TimingSettings settings;
  settings.rate = config.rate;
  settings.seconds = kSeconds;
  settings.guarded = true;
  report["timing"] = to_json(station::measure_servo(settings));
  report["machine"] = machine_facts();
}

/// \throws std::runtime_error if the file exists
void write_report(const std::string& path, const Json& report, const servo::DeviceConfig& config) {
  data::AtomicFile file(path);
  file.write(without_personal_data(report, config.serials).dump(2) + "\n");
  file.sync();
  file.commit(false);
  std::printf(
      "%s describes these devices and this machine's timing, without serial numbers and names: "
      "read it, then send it\n",
      printable(path).c_str());
}

/// Measures the delay of one device at zero force and stores it beside the calibration.
/// \return the exit status
int time_chain(const devices::DeviceKind& kind, const servo::DeviceConfig& config,
               const po::variables_map& values, Json& report) {
  const double seconds = seconds_of(values);
  for (const char* other : {"guarded", "no-fifo", "no-realtime"}) {
    if (values.count(other) > 0)
      throw UsageError(std::string("--") + other + " is for --timing without --device");
  }
  if (!values["core"].defaulted()) throw UsageError("--core is for --timing without --device");
  try {
    kind.check(config);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--device: ") + error.what());
  }
  if (!kind.has_force_feedback)
    throw UsageError(std::string("--timing --device ") + kind.name +
                     ": it has no motors, so there is no delay from pose to force");
  if (isatty(STDERR_FILENO) != 0)
    std::fprintf(stderr, "Measuring %s for %g s, at zero force ...\n", kind.name, seconds);
  const devices::ChainTiming timing = station::measure_chain(kind, config, seconds);
  std::printf("%-44s%10s%10s%10s%10s\n", "us", "median", "p99", "p99.9", "max");
  print("reading through the guard process", timing.reading);
  print("age of the pose at its use", timing.age);
  print("from a command until its force is sent", timing.wait);
  print("age + sending: the delay", timing.delay);
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "%llu ticks at %g Hz; readings lost %llu, repeated %llu; forces not sent within a tick "
      "%llu\n",
      count(timing.ticks), timing.rate, count(timing.lost), count(timing.late),
      count(timing.unsent));
  const servo::DeviceCapabilities can = kind.nominal(config);
  std::printf(
      "stable stiffness at %g Hz: %.4g N/m, without the delay %.4g N/m; the delay of 99 %% of "
      "ticks is %.3g ms\n",
      timing.rate,
      devices::with_delay(can, timing.counted(), timing.rate).max_stiffness * timing.rate /
          can.max_rate,
      can.max_stiffness * timing.rate / can.max_rate, timing.counted() * 1e3);
  report["chain"] = devices::to_json(timing);
  if (config.calibration.empty()) return 0;
  const std::string path = devices::chain_file(config.calibration);
  devices::store_chain(path, timing);
  std::printf("stored in %s: palpate validate --calibration %s uses it\n", printable(path).c_str(),
              printable(config.calibration).c_str());
  return 0;
}

servo::DeviceConfig config_of(const po::variables_map& values) {
  servo::DeviceConfig config;
  config.rate = values["rate"].as<double>();
  if (!(config.rate >= 10 && config.rate <= 10'000))
    throw UsageError("--rate: must be 10 to 10000 Hz");
  if (values.count("serial") > 0) config.serials = values["serial"].as<std::vector<std::string>>();
  if (values.count("firmware") > 0) config.firmware = values["firmware"].as<std::string>();
  if (values.count("library") > 0) config.library = values["library"].as<std::string>();
  if (values.count("service") > 0) config.service = values["service"].as<std::string>();
  if (values.count("calibration") > 0) config.calibration = values["calibration"].as<std::string>();
  return config;
}

void add_device_list_options(CommandLine& line) {
  line.usage =
      "palpate devices [--device NAME] [--timing] [--calibrate] [--markers WHERE] [--json FILE] "
      "[--report FILE]";
  line.summary =
      "Lists the connected devices with their limits and self-tests; measures whether this\n"
      "machine keeps the servo's timing; calibrates forces; sends markers to try their wiring.\n"
      "Self-tests command zero force.";
  line.example = R"(  palpate devices                                       what is there
  palpate devices --device falcon --firmware nvent.bin  opens one and tests it
  palpate devices --timing --seconds 60                 is this machine fit at 1 kHz?
  palpate devices --timing --device inverse3 --calibration lab.json    delay from pose to force
  palpate devices --device forcedimension --report found.json          for palpate's developers
  palpate devices --calibrate --device falcon --calibration lab.json --weights 0.1,0.2,0.4
  palpate devices --calibrate --device forcedimension                  moves its arm to its stops
  palpate devices --markers parport:/dev/parport0       does the EEG amplifier see each code?
)";
  line.options.add_options()                                                                //
      ("device", po::value<std::string>()->value_name("NAME"), "only this kind of device")  //
      ("serial", po::value<std::vector<std::string>>()->value_name("S"),
       "which one of several; two devices of a stylus: twice, the tip's first")  //
      ("firmware", po::value<std::string>()->value_name("FILE"),
       "to upload where the device needs it")  //
      ("library", po::value<std::string>()->value_name("FILE"),
       "the maker's, where a device is reached through one; default: looked for")  //
      ("service", po::value<std::string>()->value_name("HOST:PORT"),
       "the maker's program, where a device is reached through one; default: its own port here")  //
      ("calibration", po::value<std::string>()->value_name("FILE"), "file of calibrations")       //
      ("rate", po::value<double>()->default_value(1000)->value_name("HZ"), "of the servo")        //
      ("timing",
       "measure this machine; exit status 1 when it is not fit. With --device: measure the delay "
       "from its pose to its force, at zero force, and store it beside the calibration as "
       "NAME.timing.json")                                                                        //
      ("seconds", po::value<double>()->default_value(10)->value_name("S"), "--timing: duration")  //
      ("guarded", "--timing: with the device in a guard process, as a Falcon is")                 //
      ("no-fifo", "--timing: without real-time priority")                                         //
      ("no-realtime", "--timing: without any real-time right")                                    //
      ("core", po::value<int>()->default_value(-1, "any")->value_name("N"),
       "--timing: on this processor only")  //
      ("sound", po::value<std::string>()->value_name("NAME"),
       "measure how late contacts are heard at an ALSA device (with --loopback); with "
       "--calibration FILE it is stored beside that")  //
      ("loopback", po::value<std::string>()->value_name("IN"),
       "--sound: the ALSA input to which a cable leads back from the output")  //
      ("calibrate", "guided calibration of a device")                          //
      ("markers", po::value<std::vector<std::string>>()->composing()->value_name("WHERE"),
       "send one marker of each kind, half a second apart, to what `palpate run --markers` takes; "
       "exit status 1 when one is not taken")                                               //
      ("json", po::value<std::string>()->value_name("FILE"), "write the findings as JSON")  //
      ("report", po::value<std::string>()->value_name("FILE"),
       "write limits, self-tests and timing of these devices to a new file for palpate's "
       "developers, without personal data")  //
      ("force", "replace an existing file");
  add_calibrate_options(line.options);
}

/// \param only  the kind that was named, or nullptr for all. \return the exit status
int list_devices(const devices::DeviceKind* only, const servo::DeviceConfig& config, Json& report) {
  try {
    if (only != nullptr) only->check(config);
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--device: ") + error.what());
  }
  int status = 0;
  report["devices"] = Json::array();
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    if (only != nullptr && only != &kind) continue;
    if (!list_kind(kind, config, only != nullptr, report["devices"])) status = 1;
  }
  return status;
}

/// One marker of each kind to each receiver. \return the exit status
int try_markers(const std::vector<std::string>& names) {
  using Kind = session::Marker::Kind;
  constexpr std::chrono::milliseconds kApart(500);
  std::vector<std::unique_ptr<session::MarkerSink>> sinks;
  for (const std::string& name : names) {
    try {
      sinks.push_back(session::open_marker_sink(name, session::MarkerCodes::this_computer));
    } catch (const std::invalid_argument& error) {
      throw UsageError(std::string("--markers: ") + error.what());
    }
  }
  servo::RealClock clock;
  int status = 0;
  for (const Kind kind : {Kind::trial_start, Kind::first_contact, Kind::response, Kind::time_out,
                          Kind::cut_off, Kind::interval, Kind::sync}) {
    session::Marker marker;
    marker.kind = kind;
    marker.participant = "TEST";
    marker.code = session::code_of(marker, protocols::usual_event_codes());
    std::cout << marker.code << "  " << session::to_string(kind);
    for (std::size_t i = 0; i < sinks.size(); ++i) {
      marker.time_ns = clock.now_ns();
      const bool taken = sinks[i]->send(marker);
      if (!taken) status = 1;
      std::cout << (taken ? "  sent to " : "  NOT TAKEN by ") << printable(names[i]);
    }
    std::cout << std::endl;  // each as it is sent: somebody watches the recorder
    std::this_thread::sleep_for(kApart);
  }
  return status;
}

}  // namespace

int devices_command(const std::vector<std::string>& args) {
  CommandLine line;
  add_device_list_options(line);
  const auto values = line.parse(args);
  if (!values) return 0;
  if (values->count("markers") > 0) {
    for (const char* other : {"device", "timing", "calibrate", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(
            std::string(
                "--markers sends markers and does nothing else; it cannot be combined with --") +
            other);
    }
    return try_markers((*values)["markers"].as<std::vector<std::string>>());
  }
  if (values->count("loopback") != values->count("sound"))
    throw UsageError("--sound and --loopback go together: the output and the input of a cable");
  const servo::DeviceConfig config = config_of(*values);
  output::Outputs outputs(*values, {"json"}, {"calibration", "firmware"});
  if (values->count("report") > 0) {
    for (const char* other : {"timing", "calibrate", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--report includes it; do not combine it with --") + other);
    }
    const auto path = (*values)["report"].as<std::string>();
    if (std::filesystem::exists(path))
      throw UsageError("--report: " + printable(path) + " exists; name another file");
  }
  const bool named = values->count("device") > 0;
  const std::string name = named ? (*values)["device"].as<std::string>() : "";
  const devices::DeviceKind* const only = named ? &station::find_device_kind(name) : nullptr;
  if (values->count("calibrate") > 0) {
    if (!named) throw UsageError("--calibrate: name the device with --device");
    return calibrate_devices(*only, config, *values);
  }
  Json report = {{"program_version", PALPATE_VERSION}};
  int status = 0;
  if (values->count("sound") > 0) {
    for (const char* other : {"device", "timing", "calibrate", "report"}) {
      if (values->count(other) > 0)
        throw UsageError(
            std::string("--sound measures sound and nothing else; it cannot be combined with --") +
            other);
    }
    status = measure_sound((*values)["sound"].as<std::string>(),
                           (*values)["loopback"].as<std::string>(), config.calibration, report);
    outputs.put("json", report.dump(2) + "\n");
    outputs.write();
    return status;
  }
  if (values->count("timing") == 0) {
    status = list_devices(only, config, report);
  } else {
    status = named ? time_chain(*only, config, *values, report) : timing(*values, config, report);
  }
  if (values->count("report") > 0) {
    add_timing(only, config, report);
    write_report((*values)["report"].as<std::string>(), report, config);
  }
  outputs.put("json", report.dump(2) + "\n");
  outputs.write();
  return status;
}

}  // namespace palpate::runner::commands
