#include "runner/devices/registry.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "data/base/json_text.h"
#include "runner/devices/falcon/open.h"
#include "runner/devices/forcedimension/forcedimension.h"
#include "runner/devices/haply/inverse3.h"
#include "runner/devices/mouse.h"
#include "runner/devices/simulated.h"
#include "runner/devices/touch/touch.h"

namespace palpate::runner::devices {
namespace {

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

template <const char* name>
void check_named(const servo::DeviceConfig& config) {
  check_pair(config, name);
}

template <const char* name, servo::DeviceCapabilities (*nominal)(const servo::DeviceConfig&)>
servo::DeviceCapabilities nominal_pair(const servo::DeviceConfig& config) {
  return pair_of(nominal(config), name);
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

/// What `work` returns in a separate process, which a maker's library can crash or hold up.
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
