#include "runner/devices/touch/touch.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "data/base/text.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::devices::touch {
namespace {

void* load(const std::string& path) {
  std::vector<std::string> places = {path};
  if (path.empty()) places = {"libHD.so", "libHD.so.3", "libHD.so.3.4"};
  std::string tried;
  for (const std::string& place : places) {
    // Load it globally: the driver's own libraries look for its symbols.
    if (void* const handle = dlopen(place.c_str(), RTLD_NOW | RTLD_GLOBAL)) return handle;
    const char* const why = dlerror();
    tried += "\n  " + (why != nullptr ? std::string(why) : place);
  }
  throw std::runtime_error(
      "OpenHaptics' library cannot be loaded; install the maker's device driver and OpenHaptics, "
      "or name libHD.so with --library. Tried:" +
      tried);
}

constexpr unsigned long kSchedulerRate = 1000;      // Hz
constexpr unsigned short kPriority = 0xFFFF;        // the highest
constexpr std::int64_t kSilent_ns = 25'000'000;     // without a call: the device counts as silent
constexpr std::int64_t kTroubleLasts = 50'000'000;  // ns; shows an error this long
constexpr int kMostErrors = 16;         // errors taken in a call: a faulty library may never end
constexpr int kCalibrationCalls = 100;  // calls between two checks of the calibration
constexpr double kFarthest = 0.5;       // m; no model reaches so far
constexpr double kMaxSpeed = 5, kJump = 1e-3;  // m/s and m
// A Touch's continuous force, the safe value, for devices that report none.
constexpr double kLeastForce = 0.88, kMostForce = 40, kLeastStiffness = 500, kMostStiffness = 5000;
// The widest side of a workspace, as reported: 160 mm of a Touch to 838 mm of the largest Phantom.
constexpr double kNarrowest = 50, kWidest = 2000;
constexpr double kReach = 0.035;  // m; half the smallest side of a Touch's workspace

/// Number of this process's devices that the scheduler calls. The scheduler is stopped while
/// another is opened. For the thread that opens and closes.
int& running() {
  static int devices = 0;
  return devices;
}

std::string text_of(const char* text, const char* otherwise) {
  return text != nullptr && *text != '\0' ? printable(text) : otherwise;
}

/// The newest error, or 0; discards all others.
unsigned last_error(const Library& library) {
  unsigned newest = 0;
  for (int i = 0; i < kMostErrors; ++i) {
    const unsigned code = library.get_error().code;
    if (code == 0) break;
    if (newest == 0) newest = code;
  }
  return newest;
}

std::string why_not_opened(const Library& library, unsigned code) {
  if (code == kInUse) return "another program uses it: end that program";
  if (code == kLicence) return "OpenHaptics has no licence on this computer";
  return text_of(code != 0 ? library.error_string(code) : nullptr, "no reason is given") +
         ": check its cable, its power supply and the rights of its serial port (group dialout), "
         "and run the maker's setup";
}

/// The style for an update of the calibration: the library takes one, not the mask of those that
/// the device has. 0: none may be used. A reset of the encoders would set their zero where the hand
/// is.
unsigned style_of(unsigned mask) {
  for (const unsigned style : {kAuto, kInkwell})
    if ((mask & style) != 0) return style;
  return 0;
}

servo::DeviceCapabilities capabilities_of() {
  servo::DeviceCapabilities can;
  can.name = "touch";
  can.sensed_freedom = 5;
  can.actuated_freedom = 3;
  can.max_force = kLeastForce;
  can.max_stiffness = kLeastStiffness;
  can.max_rate = kSchedulerRate;
  can.workspace_radius = kReach;
  can.resolution = 5.5e-5;
  return can;
}

}  // namespace

const Library& Library::get(const std::string& path) {
  static const Library library(path);
  return library;
}

Library::Library(const std::string& path) {
  void* const from = load(path);
  std::string missing;
  const auto require = [&](const char* name, auto& function) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(from, name));
    if (function == nullptr) missing += std::string(missing.empty() ? "" : ", ") + name;
  };
  require("hdInitDevice", init_device);
  require("hdDisableDevice", disable_device);
  require("hdMakeCurrentDevice", make_current);
  require("hdBeginFrame", begin_frame);
  require("hdEndFrame", end_frame);
  require("hdEnable", enable);
  require("hdIsEnabled", is_enabled);
  require("hdGetDoublev", get_doubles);
  require("hdGetIntegerv", get_integers);
  require("hdSetDoublev", set_doubles);
  require("hdGetString", get_string);
  require("hdGetError", get_error);
  require("hdGetErrorString", error_string);
  require("hdCheckCalibration", check_calibration);
  require("hdUpdateCalibration", update_calibration);
  require("hdSetSchedulerRate", set_rate);
  require("hdStartScheduler", start);
  require("hdStopScheduler", stop);
  require("hdScheduleAsynchronous", schedule);
  require("hdUnschedule", unschedule);
  if (!missing.empty())
    throw std::runtime_error(
        "this is not an OpenHaptics library that palpate can use (3.0 or newer): it has no " +
        missing);
}

TouchDevice::TouchDevice(const servo::DeviceConfig& config)
    : config_(config),
      library_(Library::get(config.library)),
      silence_ns_(1e9 * std::max(0.005, 5 / config.rate)) {
  open();
}

TouchDevice::~TouchDevice() { close(); }

void TouchDevice::open() {
  const std::string name = config_.serials.empty() ? "" : config_.serials[0];
  if (running() > 0) library_.stop();
  last_error(library_);
  handle_ = library_.init_device(name.empty() ? nullptr : name.c_str());
  const unsigned failed = last_error(library_);
  if (handle_ == kNoHandle || failed != 0) {
    if (handle_ != kNoHandle) library_.disable_device(handle_);
    handle_ = kNoHandle;
    if (running() > 0) library_.start();
    throw std::runtime_error(
        (name.empty() ? std::string("the default device") : "'" + name + "'") +
        " of 3D Systems cannot be opened: " + why_not_opened(library_, failed));
  }
  library_.make_current(handle_);
  library_.enable(kForceOutput);
  library_.enable(kForceClamping);
  try {
    check_settings();
  } catch (const std::runtime_error&) {
    library_.disable_device(handle_);
    handle_ = kNoHandle;
    if (running() > 0) library_.start();
    throw;
  }
  capabilities_ = capabilities_of();
  capabilities_.serial = name;
  double force = 0, stiffness = 0;
  library_.get_doubles(kMaxForce, &force);
  library_.get_doubles(kStiffness, &stiffness);  // N/mm
  if (force > 0 && force <= kMostForce) capabilities_.max_force = force;
  stiffness *= 1e3;
  if (stiffness > 0 && stiffness <= kMostStiffness) capabilities_.max_stiffness = stiffness;
  const std::string model = text_of(library_.get_string(kModel), "a device without a name");
  const std::string number = text_of(library_.get_string(kSerialNumber), "not told");
  capabilities_.calibration = "maker's: " + model + ", serial number " + number + ", OpenHaptics";
  last_error(library_);
  wanted_.write({});
  seen_ = {};
  frames_.write(seen_);
  trouble_ = servo::DeviceTrouble::none;
  asked_ns_ = trouble_ns_ = until_calibration_ = 0;
  calibrated_ = true;
  scheduled_ = library_.schedule(called, this, kPriority);
  library_.set_rate(kSchedulerRate);
  library_.start();
  ++running();
  // Wait for a first reading.
  servo::RealClock clock;
  const std::int64_t give_up = clock.now_ns() + 500'000'000;
  while (seen_.time_ns == 0 && clock.now_ns() < give_up) {
    clock.wait_until(clock.now_ns() + 1'000'000);
    frames_.read(seen_);
  }
}

/// \throws std::runtime_error if a setting that forces or positions depend on has no effect
void TouchDevice::check_settings() {
  if (library_.is_enabled(kForceOutput) == 0)
    throw std::runtime_error(
        "the device of 3D Systems has its forces off although palpate enabled them, and forces "
        "stay off: run the maker's diagnostics");
  std::array<double, 6> corners{};
  library_.get_doubles(kWorkspace, corners.data());
  double widest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    widest = std::max(widest, std::abs(corners[axis + 3] - corners[axis]));
  // An older library may not report it.
  if (widest > 0 && !(widest >= kNarrowest && widest <= kWidest))
    throw std::runtime_error("the device of 3D Systems reports a workspace of " +
                             std::to_string(widest) +
                             ", so its positions are not in millimetres: this library is not "
                             "one that palpate can use");
}

void TouchDevice::close() noexcept {
  if (handle_ == kNoHandle) return;
  wanted_.write({});
  library_.stop();
  library_.unschedule(scheduled_);
  // Set zero force: the last force stays until another is set.
  const std::array<double, 3> zero{};
  library_.begin_frame(handle_);
  library_.set_doubles(kForce, zero.data());
  library_.end_frame(handle_);
  library_.disable_device(handle_);
  handle_ = kNoHandle;
  if (--running() > 0) library_.start();
}

void TouchDevice::reopen() {
  close();
  open();
}

unsigned TouchDevice::called(void* device) noexcept {
  static_cast<TouchDevice*>(device)->exchange();
  return 1;  // call again
}

servo::DeviceTrouble TouchDevice::errors() noexcept {
  servo::DeviceTrouble out = servo::DeviceTrouble::none;
  for (int i = 0; i < kMostErrors; ++i) {
    const unsigned code = library_.get_error().code;
    if (code == 0) break;
    if (code == kFault || code == kCommunication) {
      out = servo::DeviceTrouble::unplugged;
    } else if (code >= kWarm && code <= kTooFast && out == servo::DeviceTrouble::none) {
      out = servo::DeviceTrouble::stopped_by_device;
    } else if (out == servo::DeviceTrouble::none) {
      out = servo::DeviceTrouble::silent;
    }
  }
  return out;
}

void TouchDevice::exchange() noexcept {
  servo::RealClock clock;
  const std::int64_t now = clock.now_ns();
  Frame frame;
  Wanted wanted;
  const bool whole = wanted_.read(wanted);
  Vec3 force(wanted.x, wanted.y, wanted.z);
  const auto age = static_cast<double>(now - wanted.time_ns);
  if (!whole || age > silence_ns_ || !finite(force) || trouble_ != servo::DeviceTrouble::none)
    force = Vec3(0);
  std::array<double, 3> at{}, newtons{};
  std::array<double, 16> transform{};  // column-major
  int buttons = 0;
  library_.begin_frame(handle_);
  library_.get_doubles(kPosition, at.data());
  library_.get_doubles(kTransform, transform.data());
  library_.get_integers(kButtons, &buttons);
  const Vec3 wanted_force = from_world(force);
  newtons = {wanted_force.x, wanted_force.y, wanted_force.z};
  library_.set_doubles(kForce, newtons.data());
  library_.end_frame(handle_);
  if (whole && wanted.time_ns != set_ns_) {
    set_ns_ = wanted.time_ns;
    force_ns_.store(clock.now_ns());
  }
  if (--until_calibration_ < 0) {
    until_calibration_ = kCalibrationCalls;
    unsigned found = library_.check_calibration();
    if (found == kCalibrationUpdate) {
      int style = 0;
      library_.get_integers(kCalibrationStyle, &style);
      if (const unsigned one = style_of(static_cast<unsigned>(style))) {
        library_.update_calibration(one);
        found = library_.check_calibration();
      }
    }
    calibrated_ = found == kCalibrated;
  }
  servo::DeviceTrouble trouble = errors();
  if (trouble != servo::DeviceTrouble::none) {
    trouble_ = trouble;
    trouble_ns_ = now;
  } else if (now - trouble_ns_ > kTroubleLasts) {
    trouble_ = servo::DeviceTrouble::none;
  }
  frame.position = to_world({at[0] * 1e-3, at[1] * 1e-3, at[2] * 1e-3});
  frame.axis = to_world({transform[8], transform[9], transform[10]});
  frame.buttons = static_cast<std::uint8_t>(buttons);
  frame.asked_ns = now;
  frame.time_ns = clock.now_ns();
  frame.trouble = trouble_;
  if (frame.trouble == servo::DeviceTrouble::none && !calibrated_)
    frame.trouble = servo::DeviceTrouble::not_calibrated;
  frames_.write(frame);
}

bool TouchDevice::plausible(const Frame& frame) noexcept {
  const Vec3& at = frame.position;
  if (!finite(at) || glm::length(at) > kFarthest || !finite(frame.axis) ||
      std::abs(glm::length(frame.axis) - 1) > 0.01) {
    asked_ns_ = 0;  // do not compare the next reading with it
    return false;
  }
  // Measure from before the last frame to after this one: a busy machine may stop the thread
  // anywhere.
  const double elapsed = asked_ns_ > 0 ? static_cast<double>(frame.time_ns - asked_ns_) * 1e-9 : 1;
  const double moved = glm::length(at - tip_);
  tip_ = at;
  tail_ = at + config_.stylus_length * frame.axis;
  asked_ns_ = frame.asked_ns;
  return elapsed >= 1 || moved <= kMaxSpeed * elapsed + kJump;
}

servo::DeviceReading TouchDevice::read() noexcept {
  const bool fresh = frames_.read(seen_);
  const std::int64_t age = servo::RealClock().now_ns() - seen_.time_ns;
  servo::DeviceTrouble trouble = seen_.trouble;
  if (handle_ == kNoHandle) trouble = servo::DeviceTrouble::unplugged;
  if (trouble == servo::DeviceTrouble::none && age > kSilent_ns)
    trouble = servo::DeviceTrouble::silent;
  if (trouble == servo::DeviceTrouble::none && (fresh || lost_) && !plausible(seen_))
    trouble = servo::DeviceTrouble::implausible;
  lost_ = trouble != servo::DeviceTrouble::none;
  if (!lost_ && static_cast<double>(age) > 2e9 / config_.rate) trouble = servo::DeviceTrouble::late;
  return {{tip_, tail_}, seen_.buttons, lost_, trouble};
}

void TouchDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  Vec3 force = device1 + device2;
  if (lost_ || !finite(force)) force = Vec3(0);
  wanted_.write({force.x, force.y, force.z, servo::RealClock().now_ns()});
}

void check(const servo::DeviceConfig& config) {
  if (config.serials.size() > 1)
    throw std::invalid_argument("touch is one device; " + std::to_string(config.serials.size()) +
                                " serial numbers are given");
}

servo::DeviceCapabilities nominal(const servo::DeviceConfig& /*config*/) {
  servo::DeviceCapabilities can = capabilities_of();
  can.max_force = 0;
  return can;
}

std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config) {
  Library::get(config.library);
  std::vector<servo::ConnectedDevice> out;
  const char* const home = std::getenv("GTDD_HOME");
  if (home == nullptr || *home == '\0') return {{"", ""}};  // perhaps the default device
  std::error_code error;                                    // an unreadable folder counts as empty
  for (const auto& file :
       std::filesystem::directory_iterator(std::filesystem::path(home) / "config", error))
    if (file.path().extension() == ".config") out.push_back({file.path().stem().string(), ""});
  std::ranges::sort(out, {}, &servo::ConnectedDevice::serial);
  return out;
}

std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config) {
  return std::make_unique<TouchDevice>(config);
}

}  // namespace palpate::runner::devices::touch
