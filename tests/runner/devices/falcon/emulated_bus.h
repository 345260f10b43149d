#pragma once
// Emulated Falcons on a mocked USB bus for the real libusb: umockdev answers the kernel's usbfs
// calls with the emulator. Works across fork and exec: children inherit the mocked bus.
//
// The program must run with umockdev's library preloaded: call rerun_preloaded() of preload.h first
// in main. The mocked node always polls as ready, so libusb spins while it waits: rates by the wall
// clock are meaningless here.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tests/runner/devices/falcon/emulator.h"

namespace palpate::runner::devices::falcon::testing {

class EmulatedBus {
 public:
  EmulatedBus();
  ~EmulatedBus();
  EmulatedBus(const EmulatedBus&) = delete;
  EmulatedBus& operator=(const EmulatedBus&) = delete;

  /// Plugs another Falcon into the bus. \return its index, from 0
  int add(const std::string& serial);
  /// Unplugs it: pending transfers fail as on a real bus.
  void unplug(int index);
  /// Plugs it in again, at another address. Firmware and homing stay: it has its own power.
  void plug(int index);
  /// Whether another program holds it: it can then be opened but not claimed.
  void hold(int index, bool held);

  /// Reads or changes an emulator while the bus is running.
  void with(int index, const std::function<void(Emulator&)>& use);
  template <class T>
  T read(int index, T (Emulator::*what)() const) {
    T value{};
    with(index, [&](Emulator& emulator) { value = (emulator.*what)(); });
    return value;
  }
  /// The emulators' clock, ns.
  static std::int64_t now_ns();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::runner::devices::falcon::testing
