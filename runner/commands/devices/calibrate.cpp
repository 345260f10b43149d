#include <poll.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <chrono>
#include <iostream>
#include <memory>
#include <string_view>
#include <vector>

#include "data/base/text.h"
#include "data/files/utc.h"
#include "runner/commands/devices/devices.h"
#include "runner/commands/shared/command.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/falcon.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/devices/registry.h"
#include "runner/output/outputs.h"
#include "runner/safety/fault_signals.h"
#include "runner/safety/guarded_device.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
using namespace palpate::runner::devices::falcon;

/// Questions on stderr, ENTER on stdin; q, the end of stdin or a signal stops.
class TerminalGuide final : public Guide {
 public:
  explicit TerminalGuide(const safety::FaultSignals& signals) : signals_(signals) {}

  void say(const std::string& text) override { std::cerr << printable_lines(text) << "\n"; }
  void ask(const std::string& text) override {
    std::cerr << printable_lines(text) << "  [ENTER; q and ENTER stops] " << std::flush;
  }
  Answer answer() override {
    if (signals_.end_requested() != 0) return Answer::stop;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (poll(&input, 1, 0) > 0) {
      char letter = 0;
      if (read(STDIN_FILENO, &letter, 1) != 1) return Answer::stop;
      if (letter == '\n') {
        const bool stop = line_ == "q" || line_ == "Q";
        line_.clear();
        return stop ? Answer::stop : Answer::proceed;
      }
      if (line_.size() < 16) line_ += letter;
    }
    return Answer::none;
  }

 private:
  const safety::FaultSignals& signals_;
  std::string line_;
};

std::vector<double> parse_numbers(const std::string& text, const std::string& option) {
  std::vector<double> values;
  std::string_view rest = text;
  while (true) {
    double value = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc{}) break;
    values.push_back(value);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (rest.empty()) return values;
    if (rest.front() != ',') break;
    rest.remove_prefix(1);
  }
  throw UsageError("--" + option + " takes numbers with commas between them, not '" + text + "'");
}

void check(bool good, const std::string& expectation) {
  if (!good) throw UsageError(expectation);
}

WeighingSettings weighing_settings(const po::variables_map& values) {
  WeighingSettings settings;
  settings.weights = parse_numbers(values["weights"].as<std::string>(), "weights");
  settings.gravity = values["gravity"].as<double>();
  settings.cycle = values["sweep-seconds"].as<double>();
  settings.settle = 0.75 * settings.cycle;
  check(settings.cycle >= 1 && settings.cycle <= 60, "--sweep-seconds is between 1 and 60");
  for (const double weight : settings.weights) {
    check(weight > 0 && weight <= 2, "--weights are masses in kg, above 0 and at most 2");
  }
  check(settings.gravity > 9.7 && settings.gravity < 9.9,
        "--gravity is between 9.7 and 9.9 m/s^2 anywhere on earth");
  return settings;
}

RegistrationSettings registration_settings(const po::variables_map& values) {
  RegistrationSettings settings;
  settings.stylus_length = values["stylus-length"].as<double>();
  settings.points = values["points"].as<int>();
  const auto offset = parse_numbers(values["offset"].as<std::string>(), "offset");
  check(offset.size() == 3, "--offset takes three numbers: x,y,z in m");
  settings.offset = {offset[0], offset[1], offset[2]};
  for (const double part : offset) {
    check(part >= -1 && part <= 1, "--offset is at most 1 m each way");
  }
  check(settings.stylus_length >= 0.02 && settings.stylus_length <= 1,
        "--stylus-length is between 0.02 and 1 m");
  check(settings.points >= 4 && settings.points <= 100, "--points is between 4 and 100");
  return settings;
}

/// One device with the nominal scale: a stored calibration must not affect the measurement.
servo::DeviceConfig uncalibrated(const servo::DeviceConfig& config, const std::string& serial) {
  servo::DeviceConfig one = config;
  one.serials.clear();
  if (!serial.empty()) one.serials = {serial};
  one.calibration.clear();
  return one;
}

/// In a guard process, because forces are commanded. \param rate  Hz that the guard expects: lower
/// than the ticks' 1 kHz, so that a late tick does not interrupt the procedure
std::unique_ptr<safety::GuardedDevice> guarded(devices::OpenEnd open,
                                               const servo::DeviceConfig& config, double rate) {
  safety::GuardSettings settings;
  settings.rate = rate;
  return std::make_unique<safety::GuardedDevice>([open, config] { return open(config); }, settings);
}
constexpr double kWeighingRate = 200, kRegistrationRate = 50;  // Hz; registration uses no force

void store(const std::string& path, const Calibration& calibration) {
  output::write_whole(path, to_json(calibration));
  std::cerr << "Stored in " << printable(path) << "\n";
}

int calibrate_force(const servo::DeviceConfig& config, const po::variables_map& values) {
  const WeighingSettings settings = weighing_settings(values);
  Calibration calibration = read_calibration(config.calibration);  // reports its faults first
  safety::FaultSignals signals;
  const auto device =
      guarded(open_falcon, uncalibrated(config, config.serials.empty() ? "" : config.serials[0]),
              kWeighingRate);
  signals.watch(device.get());
  servo::request_realtime({});
  servo::RealClock clock;
  TerminalGuide guide(signals);
  wait_until_homed(*device, clock, guide);
  ForceCalibration force = weigh(*device, clock, guide, settings);
  signals.watch(static_cast<safety::GuardedDevice*>(nullptr));
  force.made_utc = now_utc();
  calibration.put(force);
  store(config.calibration, calibration);
  std::cout << "serial                   " << printable(force.serial) << "\n"
            << "counts per newton metre  " << force.counts_per_torque << " (nominal "
            << kCountsPerTorque << ")\n"
            << "residual                 " << force.residual << " N\n"
            << "sideways                 " << force.sideways << " N for each N\n"
            << "weight of the arms       " << force.arm_weight << " N\n"
            << "force in every direction " << guaranteed_force(force.counts_per_torque) << " N\n";
  if (!plausible(force)) {
    std::cerr << "This scale is more than " << kPlausibleFactor
              << " times off the nominal one and will not be used: were the weights right, and did "
                 "they hang freely?\n";
  }
  return 0;
}

int calibrate_pair(const devices::DeviceKind& kind, const servo::DeviceConfig& config,
                   const po::variables_map& values) {
  const RegistrationSettings settings = registration_settings(values);
  check(
      config.serials.size() == 2 && config.serials[0] != config.serials[1],
      std::string(kind.name) + " needs two --serial: first that of the device at the stylus' tip");
  Calibration calibration = read_calibration(config.calibration);
  safety::FaultSignals signals;
  const auto tip =
      guarded(kind.open_end, uncalibrated(config, config.serials[0]), kRegistrationRate);
  const auto tail =
      guarded(kind.open_end, uncalibrated(config, config.serials[1]), kRegistrationRate);
  servo::request_realtime({});
  servo::RealClock clock;
  TerminalGuide guide(signals);
  wait_until_homed(*tip, clock, guide);
  wait_until_homed(*tail, clock, guide);
  PairRegistration pair = register_pair(*tip, *tail, clock, guide, settings);
  pair.made_utc = now_utc();
  calibration.put(pair);
  store(config.calibration, calibration);
  const Vec3& p = pair.tail_in_tip.position;
  std::cout << "tip, tail      " << printable(pair.tip_serial) << ", "
            << printable(pair.tail_serial) << "\n"
            << "tail's centre  " << p.x << ", " << p.y << ", " << p.z << " m from the tip's\n"
            << "residual       " << pair.residual * 1e3 << " mm over " << pair.points
            << " points\n";
  return 0;
}

/// Asks before an arm moves by itself.
int let_it_calibrate(const devices::DeviceKind& kind, const servo::DeviceConfig& config) {
  std::cerr << "The device will move its arm to its stops by itself, for some seconds.\nTake your "
               "hand off the grip and everything out of its reach. Ctrl-C switches its forces "
               "off.\nType yes and ENTER to begin: "
            << std::flush;
  std::string said;
  std::getline(std::cin, said);
  if (said != "yes") {
    std::cerr << "Nothing was moved.\n";
    return 1;
  }
  std::cout << printable(devices::calibrate_by_itself(kind, config))
            << "\nThe device keeps its calibration until its power is switched off.\n";
  return 0;
}

}  // namespace

std::string now_utc() {
  return data::format_utc(std::chrono::system_clock::now().time_since_epoch() /
                          std::chrono::nanoseconds(1));
}

void add_calibrate_options(po::options_description& options) {
  auto add = options.add_options();
  add("weights", po::value<std::string>()->default_value("0.1,0.2,0.4")->value_name("KG,..."),
      "--calibrate falcon: masses to hang at the grip in turn, kg");
  add("gravity", po::value<double>()->default_value(9.80665, "9.80665")->value_name("G"),
      "--calibrate falcon: at this place, m/s^2");
  add("sweep-seconds", po::value<double>()->default_value(4)->value_name("S"),
      "--calibrate falcon: time of each of the two slow movements up and down while weighing, s");
  add("stylus-length", po::value<double>()->default_value(0.12, "0.12")->value_name("L"),
      "--calibrate, two devices: between the centres of the grips on the stylus, m");
  add("offset", po::value<std::string>()->default_value("0,0,0")->value_name("X,Y,Z"),
      "--calibrate, two devices: from the tip's grip to the tail's while points are taken, x,y,z "
      "in m; "
      "0,0,0: pinned together");
  add("points", po::value<int>()->default_value(8)->value_name("N"),
      "--calibrate, two devices: number of points to take");
}

int calibrate_devices(const devices::DeviceKind& kind, const servo::DeviceConfig& config,
                      const po::variables_map& values) {
  if (kind.move_to_calibrate != nullptr) {
    kind.check(config);
    return let_it_calibrate(kind, config);
  }
  check(!config.calibration.empty(), "--calibrate needs --calibration FILE to store into");
  data::ProtectedFiles firmware;
  firmware.add(config.firmware, "--firmware reads it, it would be overwritten");
  const std::string why = data::write_refusal(config.calibration, true, firmware);
  check(why.empty(), "--calibration " + config.calibration + ": " + why);
  if (kind.force_by_weights) return calibrate_force(config, values);
  if (kind.open_end != nullptr) return calibrate_pair(kind, config, values);
  std::string able;
  for (const devices::DeviceKind& one : devices::device_kinds())
    if (one.force_by_weights || one.open_end != nullptr || one.move_to_calibrate != nullptr)
      able += (able.empty() ? "" : ", ") + std::string(one.name);
  throw UsageError("--calibrate is for the devices " + able + ", not for '" + kind.name +
                   "': other devices have their maker's calibration");
}

}  // namespace palpate::runner::commands
