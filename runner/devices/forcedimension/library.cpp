#include "runner/devices/forcedimension/library.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

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

}  // namespace palpate::runner::devices::forcedimension
