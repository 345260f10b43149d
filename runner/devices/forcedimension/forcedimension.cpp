#include "runner/devices/forcedimension/forcedimension.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <vector>

#include "data/base/text.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::devices::forcedimension {
namespace {

namespace fs = std::filesystem;

/// Adds libraries below an installed SDK: lib/release/lin-*-gcc/libdrd.so*.
void add_installed(const char* variable, std::vector<std::string>& places) {
  const char* const root = std::getenv(variable);
  if (root == nullptr || *root == '\0') return;
  std::vector<std::string> found;
  std::error_code error;  // treat an unreadable folder as empty
  for (const auto& build : fs::directory_iterator(fs::path(root) / "lib" / "release", error)) {
    if (!build.path().filename().string().starts_with("lin-")) continue;
    for (const auto& file : fs::directory_iterator(build.path(), error))
      if (file.path().filename().string().starts_with("libdrd.so"))
        found.push_back(file.path().string());
  }
  std::sort(found.begin(), found.end());
  places.insert(places.end(), found.begin(), found.end());
}

std::vector<std::string> places_of(const std::string& path) {
  if (!path.empty()) return {path};
  std::vector<std::string> places;
  add_installed("FDSDK", places);
  add_installed("FORCEDIM_SDK", places);
  for (const char* name : {"libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3"})
    places.emplace_back(name);
  return places;
}

template <class Function>
void find(void* handle, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(handle, name));
}

constexpr double kWatchdogStep = 125e-6;  // s; at most 255 of them
constexpr unsigned char kWatchdogWhileMoving =
    200;                                       // steps: 25 ms, the library's thread may be late
constexpr double kStatusPeriod = 0.008;        // s; the status costs a separate transfer
constexpr double kFarthest = 0.5;              // m; no model reaches so far
constexpr double kMaxSpeed = 5, kJump = 1e-3;  // m/s and m; hands move the grip more slowly
constexpr int kCommunication = 2, kNoDevice = 5, kTimeOut = 7, kDeviceInUse = 20;

/// Limits from CHAI3D's list; 0: unknown.
struct Model {
  const char* family;
  double max_force, max_torque, max_stiffness, reach;  // N, N m, N/m, m
};
constexpr Model kModels[] = {{"omega", 12, 0, 5000, 0.075},
                             {"delta", 20, 0, 4000, 0.15},
                             {"sigma", 12, 0.2, 4000, 0.075},
                             {"lambda", 8, 0, 4000, 0.1125}};
constexpr Model kUnknown = {"", 8, 0, 1000, 0.05};

const Model& model_of(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c; });
  for (const Model& model : kModels)
    if (name.find(model.family) != std::string::npos) return model;
  return kUnknown;
}

servo::DeviceCapabilities capabilities_of(const Model& model, bool wrist, bool active_wrist) {
  servo::DeviceCapabilities can;
  can.name = "forcedimension";
  can.sensed_freedom = wrist ? 5 : 3;
  // Do not drive torque without a known limit.
  can.actuated_freedom = active_wrist && model.max_torque > 0 ? 5 : 3;
  can.max_torque = can.actuated_freedom == 5 ? model.max_torque : 0;
  can.max_force = model.max_force;
  can.max_stiffness = model.max_stiffness;
  can.max_rate = 4000;
  can.workspace_radius = model.reach;
  can.resolution = 1e-5;
  return can;
}

std::string error_text(const Library& library) {
  const char* const text = library.error_get_last_str();
  return text != nullptr ? printable(text) : "no reason is given";
}

/// Result of opening a device.
struct Found {
  char id;
  std::string serial, name;
};

Found open_one(const Library& library, int (*open_id)(char index), int index) {
  const int id = open_id(static_cast<char>(index));
  if (id < 0) {
    throw std::runtime_error(library.error_get_last() == kDeviceInUse
                                 ? "another program uses it: end that program"
                                 : "it cannot be opened: " + error_text(library));
  }
  unsigned short serial = 0;
  const bool numbered = library.get_serial_number(&serial, static_cast<char>(id)) >= 0;
  const char* const name = library.get_system_name(static_cast<char>(id));
  return {static_cast<char>(id), numbered ? std::to_string(serial) : "",
          name != nullptr ? printable(name) : "a device without a name"};
}

/// Ids of the devices open in this process: the library keeps one list of devices for the process
/// and may return the id of an open device again. For the thread that opens and closes.
std::vector<char>& held() {
  static std::vector<char> ids;
  return ids;
}
bool is_held(char id) { return std::count(held().begin(), held().end(), id) > 0; }

/// The watchdog's time in steps. It equals the guard process's: 5 ms, or 5 ticks of a slow servo.
unsigned char watchdog_of(double rate) {
  return static_cast<unsigned char>(
      std::min(255.0, std::ceil(std::max(0.005, 5 / rate) / kWatchdogStep)));
}

/// Number of devices. \throws std::runtime_error
int count_of(const Library& library) {
  constexpr int kMost = 16;
  const int count = library.get_device_count();
  if (count < 0)
    throw std::runtime_error("Force Dimension devices cannot be counted: " + error_text(library));
  return std::min(count, kMost);
}

/// Opens the device with the config's serial number, or the first that is free, by `open_id`.
/// Identifies it by its serial number: indices change as devices come and go.
/// \throws std::runtime_error with the obstacle
Found open_wanted(const Library& library, int (*open_id)(char index),
                  const servo::DeviceConfig& config) {
  const int count = count_of(library);
  const std::string wanted = config.serials.empty() ? "" : config.serials[0];
  std::string others, trouble;
  for (int index = 0; index < count; ++index) {
    try {
      Found device = open_one(library, open_id, index);
      const bool ours = is_held(device.id);
      if (!ours && (wanted.empty() || device.serial == wanted)) return device;
      others += (others.empty() ? "" : ", ") + device.serial;
      if (!ours) library.close(device.id);
    } catch (const std::runtime_error& error) {
      trouble = error.what();
    }
  }
  std::string text = wanted.empty() ? "no Force Dimension device is ready"
                                    : "no Force Dimension device has the serial number " + wanted;
  if (!others.empty()) text += "; connected: " + others;
  if (!trouble.empty()) text += "; one reports: " + trouble;
  if (count == 0) text += ": check its cable, its power supply and the rights to use USB";
  throw std::runtime_error(text);
}

}  // namespace

void Library::Unload::operator()(void* handle) const { dlclose(handle); }

Library::Library(const std::string& path) {
  std::string tried;
  for (const std::string& place : places_of(path)) {
    handle_.reset(dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL));
    if (handle_) break;
    const char* const why = dlerror();
    tried += "\n  " + (why != nullptr ? std::string(why) : place);
  }
  if (!handle_)
    throw std::runtime_error(
        "Force Dimension's library cannot be loaded; install the maker's SDK, then set FDSDK to "
        "its "
        "folder or name libdrd.so with --library. Tried:" +
        tried);
  void* const from = handle_.get();
  std::string missing;
  const auto require = [&](const char* name, auto& function) {
    find(from, name, function);
    if (function == nullptr) missing += std::string(missing.empty() ? "" : ", ") + name;
  };
  require("dhdGetSDKVersion", get_sdk_version);
  require("dhdGetDeviceCount", get_device_count);
  require("dhdOpenID", open_id);
  require("dhdClose", close);
  require("dhdGetSerialNumber", get_serial_number);
  require("dhdGetSystemName", get_system_name);
  require("dhdGetStatus", get_status);
  require("dhdHasWrist", has_wrist);
  require("dhdHasActiveWrist", has_active_wrist);
  require("dhdHasGripper", has_gripper);
  require("dhdGetPositionAndOrientationFrame", get_position_and_frame);
  require("dhdSetForceAndTorque", set_force_and_torque);
  require("dhdEnableForce", enable_force);
  require("dhdSetBrakes", set_brakes);
  require("dhdSetGravityCompensation", set_gravity_compensation);
  require("dhdGetButtonMask", get_button_mask);
  require("dhdEnableExpertMode", enable_expert_mode);
  require("dhdSetTimeGuard", set_time_guard);
  require("dhdErrorGetLast", error_get_last);
  require("dhdErrorGetLastStr", error_get_last_str);
  find(from, "dhdSetWatchdog", set_watchdog);
  find(from, "dhdEmulateButton", emulate_button);
  find(from, "drdOpenID", open_to_regulate);
  find(from, "drdIsInitialized", is_initialized);
  find(from, "drdAutoInit", auto_init);
  find(from, "drdStop", stop_regulation);
  if (!missing.empty())
    throw std::runtime_error(
        "this is not a Force Dimension library that palpate can use (SDK 3.7 or newer): it has "
        "no " +
        missing);
}

std::string Library::version() const {
  int major = 0, minor = 0, release = 0, revision = 0;
  get_sdk_version(&major, &minor, &release, &revision);
  return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(release) + "." +
         std::to_string(revision);
}

ForceDimensionDevice::ForceDimensionDevice(const servo::DeviceConfig& config)
    : config_(config), library_(config.library) {
  open();
}

ForceDimensionDevice::~ForceDimensionDevice() { close(); }

void ForceDimensionDevice::open() {
  const Found device = open_wanted(library_, library_.open_id, config_);
  id_ = device.id;
  held().push_back(device.id);
  const char id = *id_;
  const auto need = [&](int result, const char* what) {
    if (result >= 0) return;
    const std::string why = error_text(library_);
    close();
    throw std::runtime_error(std::string("the Force Dimension device does not take '") + what +
                             "': " + why);
  };
  need(library_.enable_expert_mode(), "expert mode");  // needed by the two below
  need(library_.set_time_guard(0, id), "no time guard");
  const bool watched =
      library_.set_watchdog != nullptr && library_.set_watchdog(watchdog_of(config_.rate), id) >= 0;
  need(library_.set_brakes(1, id), "brakes on");
  need(library_.set_gravity_compensation(1, id), "gravity compensation");
  if (library_.has_gripper(id) && library_.emulate_button != nullptr)
    library_.emulate_button(1, id);  // report a closed gripper as a button
  // Forces stay off until the device has been calibrated.
  std::array<int, kStatusRoom> status{};
  need(library_.get_status(status.data(), id), "a query of its status");
  need(status[kGravity] != 0 ? 0 : -1, "gravity compensation");
  need(status[kTimeGuard] == 0 ? 0 : -1, "no time guard");
  const bool calibrated = status[kReset] == 0;
  if (calibrated) need(library_.enable_force(1, id), "forces on");
  library_.set_force_and_torque(0, 0, 0, 0, 0, 0, id);

  capabilities_ =
      capabilities_of(model_of(device.name), library_.has_wrist(id), library_.has_active_wrist(id));
  capabilities_.serial = device.serial;
  capabilities_.calibration = "maker's: " + device.name + ", SDK " + library_.version();
  if (!watched) {
    capabilities_.calibration += ", WITHOUT the firmware's watchdog";
    std::fprintf(stderr,
                 "This device's firmware has no watchdog: zero force after a crash "
                 "depends on palpate's guard process only.\n");
  }
  pushed_ = false;
  asked_ns_ = 0;
  until_status_ = 0;
  status_ = write_trouble_ = servo::DeviceTrouble::none;
}

void ForceDimensionDevice::close() noexcept {
  if (!id_) return;
  library_.set_force_and_torque(0, 0, 0, 0, 0, 0, *id_);
  library_.enable_force(0, *id_);
  library_.close(*id_);
  std::erase(held(), *id_);
  id_.reset();
}

void ForceDimensionDevice::reopen() {
  close();
  config_.serials = {capabilities_.serial};
  if (capabilities_.serial.empty()) config_.serials.clear();
  open();
}

servo::DeviceTrouble ForceDimensionDevice::last_error() const noexcept {
  switch (library_.error_get_last()) {
    case kCommunication:
    case kNoDevice:
      return servo::DeviceTrouble::unplugged;
    case kDeviceInUse:
      return servo::DeviceTrouble::in_use;
    case kTimeOut:
    default:
      return servo::DeviceTrouble::silent;
  }
}

servo::DeviceTrouble ForceDimensionDevice::trouble_of_status() noexcept {
  std::array<int, kStatusRoom> status{};
  if (library_.get_status(status.data(), *id_) < 0) return last_error();
  if (status[kConnected] == 0) return servo::DeviceTrouble::unplugged;
  if (status[kPower] == 0) return servo::DeviceTrouble::silent;
  if (status[kReset] != 0) return servo::DeviceTrouble::not_calibrated;
  const bool stopped = status[kForce] == 0 || status[kError] != 0;
  // It was calibrated just now, or has received no command since it was opened: enable forces, with
  // zero force until the servo commands another.
  if (status_ == servo::DeviceTrouble::not_calibrated || (stopped && !pushed_)) {
    library_.set_force_and_torque(0, 0, 0, 0, 0, 0, *id_);
    return library_.enable_force(1, *id_) < 0 ? last_error() : servo::DeviceTrouble::none;
  }
  return stopped ? servo::DeviceTrouble::stopped_by_device : servo::DeviceTrouble::none;
}

bool ForceDimensionDevice::plausible(const Vec3& position, const Vec3& axis,
                                     std::int64_t asked_ns) noexcept {
  // Measure from before the last reading to after this one: a busy machine may stop the thread
  // anywhere.
  const std::int64_t now = servo::RealClock().now_ns();
  const double elapsed = asked_ns_ > 0 ? static_cast<double>(now - asked_ns_) * 1e-9 : 1;
  const double moved = glm::length(position - tip_);
  tip_ = position;
  tail_ = position;
  asked_ns_ = asked_ns;
  if (!finite(position) || !finite(axis) || glm::length(position) > kFarthest) {
    tip_ = tail_ = Vec3(0);
    asked_ns_ = 0;  // do not compare the next reading with it
    return false;
  }
  if (capabilities_.sensed_freedom == 5) {
    if (std::abs(glm::length(axis) - 1) > 0.01) return false;
    tail_ = position + config_.stylus_length * axis;
  }
  return moved <= kMaxSpeed * elapsed + kJump || elapsed >= 1;
}

servo::DeviceReading ForceDimensionDevice::read() noexcept {
  servo::DeviceTrouble trouble = servo::DeviceTrouble::unplugged;
  std::uint8_t buttons = 0;
  if (id_) {
    double x = 0, y = 0, z = 0, frame[3][3] = {};
    const std::int64_t asked_ns = servo::RealClock().now_ns();
    if (library_.get_position_and_frame(&x, &y, &z, frame, *id_) < 0) {
      trouble = last_error();
    } else {
      pose_ns_ = asked_ns;
      trouble = write_trouble_;
      if (--until_status_ < 0 || status_ != servo::DeviceTrouble::none) {
        until_status_ = static_cast<int>(kStatusPeriod * config_.rate);
        status_ = trouble_of_status();
      }
      if (trouble == servo::DeviceTrouble::none) trouble = status_;
      const Vec3 along(frame[0][0], frame[1][0], frame[2][0]);
      const bool possible = plausible(to_world({x, y, z}), to_world(along), asked_ns);
      if (trouble == servo::DeviceTrouble::none && !possible)
        trouble = servo::DeviceTrouble::implausible;
      buttons = static_cast<std::uint8_t>(library_.get_button_mask(*id_));
    }
  }
  lost_ = trouble != servo::DeviceTrouble::none;
  return {{tip_, tail_}, buttons, lost_, trouble};
}

void ForceDimensionDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  if (!id_) return;
  Vec3 force = device1 + device2, torque(0);
  if (capabilities_.actuated_freedom == 5) torque = glm::cross(tail_ - tip_, device2);
  if (lost_ || !finite(force) || !finite(torque)) force = torque = Vec3(0);
  pushed_ = pushed_ || force != Vec3(0) || torque != Vec3(0);
  const Vec3 f = from_world(force), t = from_world(torque);
  const bool taken = library_.set_force_and_torque(f.x, f.y, f.z, t.x, t.y, t.z, *id_) >= 0;
  force_ns_ = servo::RealClock().now_ns();
  write_trouble_ = taken ? servo::DeviceTrouble::none : last_error();
}

void check(const servo::DeviceConfig& config) {
  if (config.serials.size() > 1)
    throw std::invalid_argument("forcedimension is one device; " +
                                std::to_string(config.serials.size()) +
                                " serial numbers are given");
}

servo::DeviceCapabilities nominal(const servo::DeviceConfig& /*config*/) {
  servo::DeviceCapabilities can = capabilities_of(kModels[0], true, false);
  can.max_force = 0;
  return can;
}

std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config) {
  const Library library(config.library);
  const int count = count_of(library);
  std::vector<servo::ConnectedDevice> out;
  for (int index = 0; index < count; ++index) {
    try {
      const Found device = open_one(library, library.open_id, index);
      out.push_back({device.serial, ""});
      library.close(device.id);
    } catch (const std::runtime_error& error) {
      out.push_back({"", error.what()});
    }
  }
  return out;
}

std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config) {
  return std::make_unique<ForceDimensionDevice>(config);
}

std::string move_to_calibrate(const servo::DeviceConfig& config) {
  const Library library(config.library);
  if (library.open_to_regulate == nullptr || library.is_initialized == nullptr ||
      library.auto_init == nullptr || library.stop_regulation == nullptr ||
      library.set_watchdog == nullptr)
    throw std::runtime_error(
        "this library cannot move a device safely to calibrate it: name the maker's libdrd.so with "
        "--library, or use the maker's program");
  if (config.serials.empty() && count_of(library) > 1)
    throw std::runtime_error("several devices are connected: name the one to move with --serial");
  const Found device = open_wanted(library, library.open_to_regulate, config);
  const std::string name = device.name + ", serial number " + device.serial;
  const auto is_calibrated = [&] {
    std::array<int, kStatusRoom> status{};
    return library.get_status(status.data(), device.id) >= 0 && status[kReset] == 0 &&
           library.is_initialized(device.id);
  };
  const bool was_calibrated = is_calibrated();
  std::string trouble;
  if (!was_calibrated) {
    // If this process ends, the firmware switches forces off.
    const bool moved = library.enable_expert_mode() >= 0 &&
                       library.set_watchdog(kWatchdogWhileMoving, device.id) >= 0 &&
                       library.auto_init(device.id) >= 0;
    if (!moved) trouble = " was not calibrated: " + error_text(library);
    library.stop_regulation(true, device.id);
    if (moved && !is_calibrated())
      trouble = " moved but reports no calibration: calibrate it as its manual says";
  }
  library.set_force_and_torque(0, 0, 0, 0, 0, 0, device.id);
  library.enable_force(0, device.id);
  library.close(device.id);
  if (!trouble.empty()) throw std::runtime_error(name + trouble);
  return name + (was_calibrated ? ": is calibrated already, it was not moved" : ": is calibrated");
}

}  // namespace palpate::runner::devices::forcedimension
