#pragma once
// The watchdog: a small process of its own (the guard) that owns the real device and commands zero
// force if the runner crashes or hangs. It passes readings to the runner and the runner's commands
// to the device; when the runner's calls stop, it sends zero force and goes on sending it.

#include <functional>
#include <memory>

#include "runner/safety/guard_channel.h"
#include "runner/servo/device.h"

namespace palpate::runner {

struct GuardSettings {
  double rate = 1000;  ///< Hz, of the servo
  /// s; without a call of the runner's for so long, or for 5 periods where that is more: zero force
  double silence = 0.005;
  double linger = 1;      ///< s; zero force is sent for so long after the runner has died
  double patience = 120;  ///< s; for the device to be opened: firmware may have to be uploaded
  double given_up = 30;   ///< s; a guard that has been silent for so long counts as ended
  int priority = 85;      ///< of SCHED_FIFO, where allowed; above the servo's. 0: do not ask
};

using DeviceFactory = std::function<std::unique_ptr<Device>()>;

/// Runs the guard in a process that has just been forked; returns when the process is to exit.
/// Forces pass only once a zero command has come from a runner that knows of every time the guard
/// has cut them off, so nothing stale is ever felt. \param runner  process id
void run_guard(GuardChannel& channel, const DeviceFactory& factory, const GuardSettings& settings,
               int runner) noexcept;

}  // namespace palpate::runner
