#pragma once
// The devices that this program knows by name: what `run --device` and `devices` offer.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runner/servo/device.h"

namespace palpate::runner {

/// What a session asks of a device.
struct DeviceOrder {
  double rate = 1000;                ///< Hz, of the servo
  double stylus_length = 0.12;       ///< m
  double stylus_grip = 0.06;         ///< m, from the tip
  std::vector<std::string> serials;  ///< which ones, where several are plugged in; empty: any
  std::string firmware;              ///< file to upload where the device needs one; empty: none
  std::string calibration;           ///< file of calibrations; empty: none
};

/// One that is there now.
struct ConnectedDevice {
  std::string serial;   ///< empty where it has none
  std::string trouble;  ///< why it cannot be used; empty: it can
};

struct DeviceKind {
  const char* name;
  const char* description;
  bool pushes;  ///< moves a real hand: a guard process must own it
  /// What can be wrong with an order before any device is touched, in this process: the guard's
  /// words come back without their kind. \throws std::invalid_argument (usage), InputError (files)
  void (*check)(const DeviceOrder& order);
  /// \throws std::runtime_error where this computer cannot look
  std::vector<ConnectedDevice> (*connected)();
  /// Ready to be read and written. \throws std::runtime_error saying why not and what would help
  std::unique_ptr<Device> (*open)(const DeviceOrder& order);
};

std::span<const DeviceKind> device_kinds();
/// What such a device is built for, without one: its force, serial and calibration stay open.
DeviceCapabilities nominal_capabilities(const DeviceKind& kind, const DeviceOrder& order);
/// \throws std::invalid_argument naming those there are
const DeviceKind& device_kind(const std::string& name);

}  // namespace palpate::runner
