// A stub of OpenHaptics' libHD: its functions and scheduler use a state set by a test
// (forcedimension/stub_state.h; PALPATE_STUB_STATE names the file). Written from the public
// documentation, without the maker's code. Differences from Force Dimension's: the hand is in the
// library's frame (x right, y up, z to the user); `reset` 1: calibrate by hand, 2: an update is
// due, by one of `styles`; `error` is a code of libHD that every frame reports, 1: errors without
// end; `delay` > 0: the scheduler stalls.

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/runner/devices/forcedimension/stub_state.h"

namespace {

using palpate::runner::devices::testing::StubDevice;
using palpate::runner::devices::testing::StubState;

struct Task {
  unsigned long id;
  unsigned (*callback)(void*);
  void* data;
};

struct Library {
  StubState* state = [] {
    const char* const path = std::getenv("PALPATE_STUB_STATE");
    return palpate::runner::devices::testing::map_stub_state(path != nullptr ? path
                                                                             : "/nonexistent/stub");
  }();
  std::mutex mutex;
  std::vector<Task> tasks;
  std::thread scheduler;
  std::atomic<bool> runs{false};
  unsigned long next_task = 1;
  unsigned current = 0, pending = 0;  // device of the calling thread; newest error
};

/// Never destroyed: like the maker's, it lives until the process ends.
Library& library() {
  static auto* const one = new Library;
  return *one;
}

StubDevice& device() { return library().state->device[library().current % 2]; }

/// Finds a device by its name: the serial number in decimal, or the default one.
int index_of(const char* name) {
  if (name == nullptr) return 0;
  for (int i = 0; i < static_cast<int>(library().state->count); ++i)
    if (std::to_string(static_cast<int>(library().state->device[i].serial)) == name) return i;
  return -1;
}

int styles_of(const StubDevice& one) { return one.styles > 0 ? static_cast<int>(one.styles) : 2; }

}  // namespace

extern "C" {

struct HdError {
  unsigned code;
  int internal;
  unsigned device;
};

unsigned hdInitDevice(const char* name) {
  const int i = index_of(name);
  if (i < 0 || library().state->device[i].connected == 0) {
    library().pending = 0x0302;
    return 0xFFFFFFFF;
  }
  StubDevice& one = library().state->device[i];
  if (one.in_use != 0 || one.open != 0) {
    library().pending = 0x0301;
    return 0xFFFFFFFF;
  }
  one.open = 1;
  library().current = static_cast<unsigned>(i);
  return static_cast<unsigned>(i);
}

void hdDisableDevice(unsigned id) {
  StubDevice& one = library().state->device[id % 2];
  one.open = one.forces_on = 0;
  for (double& f : one.force) f = 0;
}

void hdMakeCurrentDevice(unsigned id) { library().current = id; }

void hdBeginFrame(unsigned id) { library().current = id; }

void hdEndFrame(unsigned id) {
  StubDevice& one = library().state->device[id % 2];
  if (one.connected == 0) library().pending = 0x0302;
  if (one.too_fast != 0) library().pending = 0x0203;
  if (one.error > 1) library().pending = static_cast<unsigned>(one.error);
  if (library().pending != 0 || one.reset == 1)
    for (double& f : one.force) f = 0;
}

void hdEnable(unsigned what) {
  if (what == 0x4000 && device().deaf == 0) device().forces_on = 1;
}

unsigned char hdIsEnabled(unsigned what) { return what == 0x4000 && device().forces_on != 0; }

void hdGetDoublev(unsigned what, double* out) {
  StubDevice& one = device();
  if (what == 0x2603) *out = one.model == 3 ? std::numeric_limits<double>::quiet_NaN() : 3.3;
  if (what == 0x2602) *out = 0.5;
  if (what == 0x2050) {
    for (int i = 0; i < 3; ++i) {
      const double given = one.hand_stiffness > 0 ? one.force[i] / one.hand_stiffness : 0;
      out[i] = 1e3 * (one.hand[i] + given);
    }
    if (one.wrong == 1) out[0] = std::numeric_limits<double>::quiet_NaN();
    if (one.wrong == 2) out[1] = std::numeric_limits<double>::infinity();
    if (one.wrong == 3) out[2] = 1e9;
    if (one.wrong == 4) out[0] += 50;
  }
  if (what == 0x2551) {
    for (int i = 0; i < 6; ++i) out[i] = (i < 3 ? -80 : 80) * (one.metres != 0 ? 1e-3 : 1);
  }
  if (what == 0x2052) {
    for (int i = 0; i < 16; ++i) out[i] = i % 5 == 0;
  }
}

void hdGetIntegerv(unsigned what, int* out) {
  if (what == 0x2000) *out = static_cast<int>(device().buttons);
  if (what == 0x2555) *out = styles_of(device());
}

void hdSetDoublev(unsigned what, const double* in) {
  StubDevice& one = device();
  if (what != 0x2700) return;
  ++one.commands;
  for (int i = 0; i < 3; ++i) one.force[i] = one.forces_on != 0 && one.reset != 1 ? in[i] : 0;
}

const char* hdGetString(unsigned what) {
  static std::string serial;
  if (what == 0x2501) return "Touch";
  serial = std::to_string(static_cast<int>(device().serial));
  return what == 0x2504 ? serial.c_str() : nullptr;
}

HdError hdGetError() {
  const unsigned code = device().error == 1 ? 0x0201 : library().pending;
  library().pending = 0;
  return {code, 0, library().current};
}

const char* hdGetErrorString(unsigned code) {
  return code == 0x0302 ? "communication error" : "some error";
}

unsigned hdCheckCalibration() {
  const StubDevice& one = device();
  return one.reset == 0 ? 0x5000 : one.reset == 2 ? 0x5001 : 0x5002;
}

void hdUpdateCalibration(unsigned style) {
  StubDevice& one = device();
  one.style = style;
  const bool single = style != 0 && (style & (style - 1)) == 0;
  if (!single || (static_cast<unsigned>(styles_of(one)) & style) == 0) {
    library().pending = 0x0101;  // an invalid value
  } else if (one.reset == 2) {
    one.reset = 0;
  }
}

void hdSetSchedulerRate(unsigned long) {}

void hdStartScheduler() {
  if (library().runs.exchange(true)) return;
  library().scheduler = std::thread([] {
    while (library().runs.load()) {
      const double delay = library().state->device[0].delay;
      std::this_thread::sleep_for(delay > 0 ? std::chrono::microseconds(10'000)
                                            : std::chrono::microseconds(1'000));
      if (delay > 0) continue;
      const std::scoped_lock lock(library().mutex);
      for (const Task& task : library().tasks) task.callback(task.data);
    }
  });
}

void hdStopScheduler() {
  if (library().runs.exchange(false)) library().scheduler.join();
}

unsigned long hdScheduleAsynchronous(unsigned (*callback)(void*), void* data, unsigned short) {
  const std::scoped_lock lock(library().mutex);
  library().tasks.push_back({library().next_task, callback, data});
  return library().next_task++;
}

void hdUnschedule(unsigned long id) {
  const std::scoped_lock lock(library().mutex);
  std::erase_if(library().tasks, [id](const Task& task) { return task.id == id; });
}

}  // extern "C"
