#include "runner/devices/registry.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "data/base/json_text.h"
#include "protocols/parse.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/falcon.h"
#include "runner/devices/forcedimension/forcedimension.h"
#include "runner/devices/haply/inverse3.h"
#include "runner/devices/mouse.h"
#include "runner/devices/simulated.h"
#include "runner/devices/touch/touch.h"

namespace palpate::runner::devices {
namespace {

using falcon::Calibration;
using falcon::CalibrationState;
using falcon::CalibrationVerdict;
using falcon::PairRegistration;

Calibration calibration_of_pair(const servo::DeviceConfig& config) {
  return config.calibration.empty() ? Calibration{} : falcon::read_calibration(config.calibration);
}

/// \throws InputError if there is none
const PairRegistration& registration_of(const Calibration& calibration,
                                        const servo::DeviceConfig& config, const char* name) {
  const std::string &tip = config.serials[0], &tail = config.serials[1];
  if (const PairRegistration* pair = calibration.pair_of(tip, tail)) return *pair;
  throw protocols::InputError(
      {{config.calibration.empty() ? "(no calibration file)" : config.calibration, "/pairs",
        "expected a registration of the devices " + tip + " (tip) and " + tail +
            " (tail), which gives their relative pose: run palpate devices --calibrate --device " +
            name}});
}

using Json = nlohmann::json;
constexpr std::chrono::seconds kListingPatience(3), kCalibrationPatience(60);

std::vector<servo::ConnectedDevice> always_there(const servo::DeviceConfig& /*config*/) {
  return {{}};
}
void nothing_to_check(const servo::DeviceConfig& /*config*/) {}

std::unique_ptr<servo::Device> open_simulated(const servo::DeviceConfig& config) {
  return std::make_unique<StrokingStylus>(config.stylus_length, config.stylus_grip, config.rate);
}

std::unique_ptr<servo::Device> open_mouse(const servo::DeviceConfig& config) {
  return std::make_unique<MouseStylus>(config.stylus_length, config.rate);
}

template <std::unique_ptr<servo::Device> (*open)(const servo::DeviceConfig&)>
servo::DeviceCapabilities as_opened(const servo::DeviceConfig& config) {
  return open(config)->capabilities();
}

// Names with linkage, for template arguments.
[[maybe_unused]] constexpr char kForceDimension2[] = "forcedimension2";
[[maybe_unused]] constexpr char kInverse3x2[] = "inverse3x2";
[[maybe_unused]] constexpr char kTouch2[] = "touch2";

/// See DeviceKind::check. \throws std::invalid_argument, InputError: no registration of the two
void check_pair(const servo::DeviceConfig& config, const char* name) {
  if (config.serials.size() != 2 || config.serials[0] == config.serials[1]) {
    throw std::invalid_argument(std::string(name) +
                                " needs the serial numbers of two devices: first the one at the "
                                "stylus' tip, then the one at its tail (palpate devices lists "
                                "them)");
  }
  registration_of(calibration_of_pair(config), config, name);
}

template <const char* name>
void check_named(const servo::DeviceConfig& config) {
  check_pair(config, name);
}

template <const char* name, servo::DeviceCapabilities (*nominal)(const servo::DeviceConfig&)>
servo::DeviceCapabilities nominal_pair(const servo::DeviceConfig& config) {
  return pair_of(nominal(config), name);
}

/// Opens the two devices of config.serials, the one at the stylus's tip first. \throws
/// std::runtime_error
std::unique_ptr<servo::Device> open_pair(const servo::DeviceConfig& config, const char* name,
                                         OpenEnd open_end) {
  const Calibration calibration = calibration_of_pair(config);
  const PairRegistration& pair = registration_of(calibration, config, name);
  servo::DeviceConfig one = config;
  one.serials = {config.serials[0]};
  std::unique_ptr<servo::Device> tip = open_end(one);
  one.serials = {config.serials[1]};
  std::unique_ptr<servo::Device> tail = open_end(one);
  const CalibrationVerdict known =
      judge_pair(calibration, config.serials[0], config.serials[1],
                 std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1));
  const std::string text = (known.state == CalibrationState::good ? "" : "stale: ") + known.text +
                           "; " + tip->capabilities().calibration + "; " +
                           tail->capabilities().calibration;
  return std::make_unique<PairDevice>(std::move(tip), std::move(tail),
                                      StylusFromEnds(pair.tail_in_tip, pair.stylus_length), name,
                                      text);
}

template <const char* name, OpenEnd open_end>
std::unique_ptr<servo::Device> open_named(const servo::DeviceConfig& config) {
  return open_pair(config, name, open_end);
}

constexpr DeviceKind kKinds[] = {
    {"falcon", "a Novint Falcon: position and force of one point, no orientation", true,
     falcon::check_falcon, falcon::nominal_falcon, falcon::connected_falcons, falcon::open_falcon,
     nullptr, nullptr, true},
    {"falcon2", "two Novint Falcons that hold the ends of a stylus", true, falcon::check_falcon2,
     falcon::nominal_falcon2, falcon::connected_falcons, falcon::open_falcon2, falcon::open_falcon},
#ifdef PALPATE_FORCEDIMENSION
    {"forcedimension",
     "a Force Dimension omega, delta, sigma or lambda, through the maker's library", true,
     forcedimension::check, forcedimension::nominal, forcedimension::connected,
     forcedimension::open, nullptr, forcedimension::move_to_calibrate},
    {"forcedimension2", "two Force Dimension devices that hold the ends of a stylus", true,
     check_named<kForceDimension2>, nominal_pair<kForceDimension2, forcedimension::nominal>,
     forcedimension::connected, open_named<kForceDimension2, forcedimension::open>,
     forcedimension::open},
#endif
#ifdef PALPATE_HAPLY
    {"inverse3", "a Haply Inverse3, with or without a Verse Grip, through the maker's service",
     true, haply::check, haply::nominal, haply::connected, haply::open},
    {"inverse3x2", "two Haply Inverse3 that hold the ends of a stylus", true,
     check_named<kInverse3x2>, nominal_pair<kInverse3x2, haply::nominal>, haply::connected,
     open_named<kInverse3x2, haply::open_point>, haply::open_point},
#endif
#ifndef PALPATE_NO_OPENHAPTICS
    {"touch", "a 3D Systems Touch, Touch X or Phantom, through the maker's library", true,
     touch::check, touch::nominal, touch::connected, touch::open},
    {"touch2", "two 3D Systems devices that hold the ends of a stylus", true, check_named<kTouch2>,
     nominal_pair<kTouch2, touch::nominal>, touch::connected, open_named<kTouch2, touch::open>,
     touch::open},
#endif
    {"mouse", "the pointer moves a stylus in the window; contact is seen, not felt", false,
     nothing_to_check, as_opened<open_mouse>, always_there, open_mouse},
    {"simulated",
     "a stylus held by two simulated devices and a simulated hand that moves to and fro", false,
     nothing_to_check, as_opened<open_simulated>, always_there, open_simulated},
};

/// The message of a separate process: {"done": ...} or {"error": "..."}.
std::string message_of(const std::function<Json()>& work) noexcept {
  Json out;
  try {
    out["done"] = work();
  } catch (const std::exception& error) {
    out = {{"error", error.what()}};
  } catch (...) {
    out = {{"error", "it failed without a reason"}};
  }
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void write_all(int to, const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = write(to, text.data() + sent, text.size() - sent);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    sent += static_cast<std::size_t>(n);
  }
}

/// Reads until the other end closes; none: it took too long.
std::optional<std::string> read_all(int from, std::chrono::seconds patience) {
  const auto give_up = std::chrono::steady_clock::now() + patience;
  std::string text;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        give_up - std::chrono::steady_clock::now());
    pollfd waiting{from, POLLIN, 0};
    const int ready = left.count() > 0 ? poll(&waiting, 1, static_cast<int>(left.count())) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return std::nullopt;
    char some[4096];
    const ssize_t n = read(from, some, sizeof some);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    text.append(some, static_cast<std::size_t>(n));
  }
}

/// The result of `work` in a separate process, which a maker's library can crash or hold up.
/// \param what  "listing these devices". \throws std::runtime_error
Json in_child(const std::function<Json()>& work, std::chrono::seconds patience,
              const std::string& what) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(what + ": " + std::strerror(errno));
  const int runner = getpid();
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != runner) _exit(1);
    const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nothing >= 0) dup2(nothing, STDOUT_FILENO);  // keep a library's output out of our results
    write_all(ends[1], message_of(work));
    _exit(0);
  }
  close(ends[1]);
  const std::string why = child < 0 ? std::strerror(errno) : "";
  const std::optional<std::string> said = child < 0 ? std::nullopt : read_all(ends[0], patience);
  close(ends[0]);
  if (child < 0) throw std::runtime_error(what + ": " + why);
  if (!said) kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  if (!said)
    throw std::runtime_error(what + " took longer than " + std::to_string(patience.count()) +
                             " s: is a device stuck?");
  const Json message = json_or_discarded(*said);
  if (!message.is_object()) throw std::runtime_error(what + " crashed");
  if (message.contains("error")) throw std::runtime_error(message["error"].get<std::string>());
  return message["done"];
}

}  // namespace

servo::DeviceCapabilities pair_of(const servo::DeviceCapabilities& end, const char* name) {
  servo::DeviceCapabilities can = end;
  can.name = name;
  can.sensed_freedom = can.actuated_freedom = 5;
  can.max_torque = 0;  // forces at both ends produce it
  return can;
}

PairDevice::PairDevice(std::unique_ptr<servo::Device> tip, std::unique_ptr<servo::Device> tail,
                       const StylusFromEnds& stylus, const char* name,
                       const std::string& calibration)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  const servo::DeviceCapabilities &one = tip_->capabilities(), &other = tail_->capabilities();
  capabilities_ = pair_of(one, name);
  capabilities_.max_force = std::min(one.max_force, other.max_force);
  capabilities_.max_stiffness = std::min(one.max_stiffness, other.max_stiffness);
  capabilities_.max_rate = std::min(one.max_rate, other.max_rate);
  capabilities_.workspace_radius = std::min(one.workspace_radius, other.workspace_radius);
  capabilities_.resolution = std::max(one.resolution, other.resolution);
  capabilities_.serial = one.serial + ", " + other.serial;
  capabilities_.calibration = calibration;
}

servo::DeviceReading PairDevice::read() noexcept {
  const servo::DeviceReading tip = tip_->read(), tail = tail_->read();
  // Report the trouble of a lost end before that of a late one.
  servo::DeviceTrouble trouble = tip.trouble;
  if (!tip.lost && tail.trouble != servo::DeviceTrouble::none) trouble = tail.trouble;
  lost_ = tip.lost || tail.lost;
  if (!lost_ && !stylus_.update(tip.stylus.tip, tail.stylus.tip)) {
    lost_ = true;
    trouble = servo::DeviceTrouble::apart;
  }
  return {stylus_.stylus(), static_cast<std::uint8_t>((tip.buttons & 15U) | tail.buttons << 4U),
          lost_, trouble};
}

void PairDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  // Push with both or none: a force from one device alone would turn the stylus.
  tip_->write(lost_ ? Vec3(0) : device1, Vec3(0));
  tail_->write(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2), Vec3(0));
}

void PairDevice::reopen() {
  lost_ = true;
  write(Vec3(0), Vec3(0));
  tip_->reopen();
  tail_->reopen();
}

std::vector<servo::ConnectedDevice> list_connected(const DeviceKind& kind,
                                                   const servo::DeviceConfig& config) {
  if (!kind.has_force_feedback) return kind.connected(config);
  const auto list = [&] {
    Json listing = Json::array();
    for (const servo::ConnectedDevice& one : kind.connected(config))
      listing.push_back({{"serial", one.serial}, {"trouble", one.trouble}});
    return listing;
  };
  std::vector<servo::ConnectedDevice> found;
  for (const Json& one : in_child(list, kListingPatience, "listing these devices"))
    found.push_back({one["serial"].get<std::string>(), one["trouble"].get<std::string>()});
  return found;
}

std::string calibrate_by_itself(const DeviceKind& kind, const servo::DeviceConfig& config) {
  const auto calibrate = [&] { return Json(kind.move_to_calibrate(config)); };
  return in_child(calibrate, kCalibrationPatience, "the calibration").get<std::string>();
}

std::span<const DeviceKind> device_kinds() { return kKinds; }

const DeviceKind& device_kind(const std::string& name) {
  std::string known;
  for (const DeviceKind& kind : kKinds) {
    if (name == kind.name) return kind;
    if (!known.empty()) known += ", ";
    known += kind.name;
  }
  throw std::invalid_argument("no device '" + name + "'; there are: " + known);
}

}  // namespace palpate::runner::devices
