#pragma once
// Shared by the tests of the guard process: a scripted hand that visits a cube, and memory shared
// with a forked runner.

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include "runner/safety/guarded_device.h"
#include "tests/runner/recording_device.h"

namespace palpate::runner::safety::testing {

inline servo::DeviceReading stylus_at(double z) {
  return {{{0, 0, z}, {0, 0, z + 0.12}}, 0, false};
}
/// At rest outside for 0.15 s at 1 kHz, then down into the cube; a second in total.
inline servo::DeviceReading visiting(int tick) {
  const int at = tick % 1000;
  return stylus_at(at < 150 ? 0.1 : std::max(0.029, 0.1 - 4e-4 * (at - 150)));
}

/// Shared with the runner's process.
struct Shared {
  runner::testing::DeviceRecord record;
  std::atomic<bool> felt{false};  ///< there has been force for a while, and still is
  std::atomic<bool> go{false};    ///< tells the runner to cause its end
};
struct Stage {
  Stage()
      : shared(new (mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                         MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared) {}
  ~Stage() { munmap(shared, sizeof(Shared)); }
  Shared* shared;
};

inline void nap(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

inline GuardSettings no_rights() {
  GuardSettings settings;
  settings.linger = 0.3;
  settings.priority = 0;
  return settings;
}

}  // namespace palpate::runner::safety::testing
