#include "runner/devices/touch/library.h"

#include <dlfcn.h>

#include <stdexcept>
#include <type_traits>
#include <vector>

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

}  // namespace palpate::runner::devices::touch
