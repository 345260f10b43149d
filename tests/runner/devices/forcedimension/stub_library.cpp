// A stub of Force Dimension's library: its functions use a state set by a test (stub_state.h;
// PALPATE_STUB_STATE names the file). Written from the public documentation, without the maker's
// code. With STUB_OLD it has no watchdog, like older versions.

#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>

#include "tests/runner/devices/forcedimension/stub_state.h"

namespace {

using palpate::runner::devices::testing::StubDevice;
using palpate::runner::devices::testing::StubState;

thread_local int last_error = 0;
constexpr int kNoDevice = 5, kTimeOut = 7, kInUse = 20;
constexpr char kFirstId = 3;  // ids are no indices

StubState& state() {
  static StubState* const mapped = [] {
    const char* const path = std::getenv("PALPATE_STUB_STATE");
    return palpate::runner::devices::testing::map_stub_state(path != nullptr ? path
                                                                             : "/nonexistent/stub");
  }();
  return *mapped;
}

int fail(int error) {
  last_error = error;
  return -1;
}

double now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The open device of this id that answers; nullptr: none, and the error is set.
StubDevice* device_of(char id) {
  StubDevice& device = state().device[id == kFirstId + 1 ? 1 : 0];
  if (device.connected == 0) {
    fail(kNoDevice);
    return nullptr;
  }
  if (device.error != 0) {
    fail(static_cast<int>(device.error));
    return nullptr;
  }
  return &device;
}

void wait(double seconds) {
  if (seconds <= 0) return;
  const timespec time{static_cast<time_t>(seconds),
                      static_cast<long>(std::fmod(seconds, 1.0) * 1e9)};
  nanosleep(&time, nullptr);
}

void go_limp(StubDevice& device) {
  for (int i = 0; i < 3; ++i) device.force[i] = device.torque[i] = 0;
}

/// The firmware's watchdog.
void watch(StubDevice& device) {
  const bool silent = device.watchdog > 0 && now() - device.last_command > device.watchdog * 125e-6;
  if (device.forces_on != 0 && (silent || device.too_fast != 0 || device.power == 0)) {
    device.forces_on = 0;
    go_limp(device);
  }
}

}  // namespace

extern "C" {

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
#ifdef STUB_OLD
  *major = 3, *minor = 3, *release = 0, *revision = 1;
#else
  *major = 3, *minor = 17, *release = 5, *revision = 0;
#endif
}

int dhdGetDeviceCount() {
  int there = 0;
  for (int i = 0; i < static_cast<int>(state().count); ++i)
    there += state().device[i].connected != 0;
  return state().count < 0 ? fail(2) : there;
}

/// Indices number the connected devices: they change when a device is added or removed.
int dhdOpenID(char index) {
  int at = 0;
  for (int i = 0; i < static_cast<int>(state().count); ++i) {
    StubDevice& device = state().device[i];
    if (device.connected == 0 || at++ != index) continue;
    if (device.in_use != 0) return fail(kInUse);
    if (device.error != 0) return fail(static_cast<int>(device.error));
    device.open = 1;
    return kFirstId + i;
  }
  return fail(kNoDevice);
}

int dhdClose(char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  device->open = device->forces_on = 0;
  go_limp(*device);
  return 0;
}

int dhdGetSerialNumber(unsigned short* serial, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  *serial = static_cast<unsigned short>(device->serial);
  return 0;
}

const char* dhdGetSystemName(char id) {
  static constexpr std::array<const char*, 4> kNames = {"omega.6", "omega.3", "sigma.7", "zeta.9"};
  StubDevice* const device = device_of(id);
  return device == nullptr ? nullptr : kNames[static_cast<std::size_t>(device->model)];
}

int dhdGetStatus(int* status, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  watch(*device);
  for (int i = 0; i < 17; ++i) status[i] = 0;
  status[0] = device->power != 0;
  status[1] = 1;
  status[3] = device->reset != 0;
  status[5] = device->forces_on != 0;
  status[6] = device->brakes != 0 && device->forces_on == 0;
  status[10] = device->gravity != 0;
  status[11] = device->guarded != 0;
  status[14] = device->too_fast != 0 ? 2 : 0;
  return 0;
}

bool dhdHasWrist(char id) {
  StubDevice* const device = device_of(id);
  return device != nullptr && device->model != 1;
}
bool dhdHasActiveWrist(char id) {
  StubDevice* const device = device_of(id);
  return device != nullptr && device->model == 2;
}
bool dhdHasGripper(char id) { return dhdHasActiveWrist(id); }

int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double frame[3][3],
                                      char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  watch(*device);
  wait(device->delay);
  std::array<double, 3> at{};
  for (int i = 0; i < 3; ++i) {
    at[static_cast<std::size_t>(i)] =
        device->hand[i] +
        (device->hand_stiffness > 0 ? device->force[i] / device->hand_stiffness : 0);
    for (int k = 0; k < 3; ++k) frame[i][k] = i == k;
  }
  if (device->wrong == 1) at[0] = std::numeric_limits<double>::quiet_NaN();
  if (device->wrong == 2) at[1] = std::numeric_limits<double>::infinity();
  if (device->wrong == 3) at[2] = 1e9;
  if (device->wrong == 4) at[0] += 0.05;
  *x = at[0], *y = at[1], *z = at[2];
  return 1;  // nothing new since the last call: no error
}

int dhdSetForceAndTorque(double fx, double fy, double fz, double tx, double ty, double tz,
                         char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  watch(*device);
  device->last_command = now();
  ++device->commands;
  const std::array<double, 6> all{fx, fy, fz, tx, ty, tz};
  for (std::size_t i = 0; i < 3; ++i) {
    device->force[i] = device->forces_on != 0 ? all[i] : 0;
    device->torque[i] = device->forces_on != 0 ? all[i + 3] : 0;
  }
  return 2;  // a motor is saturated: no error
}

int dhdEnableForce(unsigned char on, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  device->last_command = now();
  device->forces_on = on != 0 && device->reset == 0 && device->too_fast == 0;
  go_limp(*device);
  return 0;
}

int dhdSetBrakes(int on, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  device->brakes = on;
  return 0;
}

int dhdSetGravityCompensation(int on, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  if (device->deaf == 0) device->gravity = on;
  return 0;
}

unsigned dhdGetButtonMask(char id) {
  StubDevice* const device = device_of(id);
  return device == nullptr ? 0 : static_cast<unsigned>(device->buttons);
}

int dhdEnableExpertMode() { return 0; }
int dhdSetTimeGuard(int microseconds, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  if (device->deaf < 2) device->guarded = microseconds != 0;
  return 0;
}
int dhdErrorGetLast() { return last_error; }
const char* dhdErrorGetLastStr() {
  switch (last_error) {
    case kNoDevice:
      return "no device found";
    case kTimeOut:
      return "timeout";
    case kInUse:
      return "device already in use";
    default:
      return "an error\x1b[2J";  // a library's text must not control the terminal
  }
}

#ifndef STUB_OLD
int dhdSetWatchdog(unsigned char periods, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  device->watchdog = periods;
  return 0;
}
int dhdEmulateButton(unsigned char /*on*/, char id) { return device_of(id) == nullptr ? -1 : 0; }

int drdOpenID(char index) { return dhdOpenID(index); }
bool drdIsInitialized(char id) {
  const StubDevice* const device = device_of(id);
  return device != nullptr && device->reset == 0;
}
int drdAutoInit(char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  if (device->power == 0) return fail(kTimeOut);
  ++device->moved;
  device->forces_on = 1;
  device->force[2] = 1;
  wait(device->delay);
  if (device->too_fast != 0) return fail(kTimeOut);  // a hand holds the arm
  device->reset = 0;
  return 0;
}
int drdStop(bool keep_forces, char id) {
  StubDevice* const device = device_of(id);
  if (device == nullptr) return -1;
  if (!keep_forces) device->forces_on = 0;
  return 0;
}
#endif

}  // extern "C"
