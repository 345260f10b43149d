#pragma once
// Emulated Falcons on a USB bus that libusb takes for real: umockdev answers the kernel's usbfs
// calls with the emulator. Works across fork and exec: children inherit the mocked bus.
//
// The program must run with umockdev's library preloaded: call rerun_preloaded() of preload.h first
// in main. The mocked node always polls as ready, so libusb spins while it waits: rates on the wall
// clock mean nothing here.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tests/runner/devices/falcon/emulator.h"

namespace palpate::runner::falcon::testing {

class EmulatedBus {
 public:
  EmulatedBus();
  ~EmulatedBus();
  EmulatedBus(const EmulatedBus&) = delete;
  EmulatedBus& operator=(const EmulatedBus&) = delete;

  /// Puts another Falcon on the bus, plugged in; its index, from 0.
  int add(const std::string& serial);
  /// Takes it off the bus: what is under way fails as it does in earnest.
  void unplug(int index);
  /// Back on the bus, at another address. Firmware and homing stay: it has its own power.
  void plug(int index);
  /// Another program holds it (true): it can be opened, but not claimed.
  void hold(int index, bool held);

  /// Looks at or changes an emulator while the bus is at work.
  void with(int index, const std::function<void(Emulator&)>& use);
  template <class T>
  T read(int index, T (Emulator::*what)() const) {
    T value{};
    with(index, [&](Emulator& emulator) { value = (emulator.*what)(); });
    return value;
  }
  /// The clock that the emulators run on, ns.
  static std::int64_t now_ns();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::runner::falcon::testing
