#pragma once
// State shared by a test and the stub library: a file of doubles, mapped by both. Python reads it
// too (stub_state.py), so all members are doubles in a fixed order.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace palpate::runner::devices::testing {

/// One device. Frame of the library: x to the user, y right, z up.
struct StubDevice {
  // Set by the test.
  double serial = 0;
  double model = 0;             ///< 0 omega.6, 1 omega.3, 2 sigma.7, 3 unknown
  double hand[3] = {0, 0, 0};   ///< m
  double hand_stiffness = 400;  ///< N/m, of the grip's displacement by forces
  double connected = 1, power = 1, reset = 0, in_use = 0;
  double wrong = 0;  ///< position: 1 NaN, 2 infinite, 3 1e9 m, 4 jumps by 50 mm
  double buttons = 0;
  double too_fast = 0;  ///< 1: the device switches its forces off
  double error = 0;     ///< code that every call fails with; 0: none
  double delay = 0;     ///< s, of every reading
  // Set by the stub.
  double force[3] = {0, 0, 0}, torque[3] = {0, 0, 0};  ///< N, N m, of a real device
  double forces_on = 0, brakes = 0, watchdog = 0, open = 0, commands = 0, last_command = 0;
  double moved = 0;  ///< times that the arm moved by itself
  // Set by the test.
  double deaf = 0;    ///< 1: settings have no effect; 2: nor has the time guard's
  double styles = 0;  ///< mask of the calibration styles, of 3D Systems; 0: auto alone
  double metres = 0;  ///< 1: the workspace is reported in another unit
  // Set by the stub.
  double gravity = 0, guarded = 1;  ///< gravity compensation; time guard
  double style = 0;                 ///< of the last update of the calibration
};

struct StubState {
  double count = 1;  ///< of devices; negative: counting fails
  StubDevice device[2];
};

/// Maps the file at `path`, creating it if necessary.
inline StubState* map_stub_state(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0 || ftruncate(file, sizeof(StubState)) != 0)
    throw std::runtime_error("no stub state at " + path);
  void* const memory =
      mmap(nullptr, sizeof(StubState), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) throw std::runtime_error("the stub state cannot be mapped: " + path);
  return static_cast<StubState*>(memory);
}

}  // namespace palpate::runner::devices::testing
