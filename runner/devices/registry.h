#pragma once
// The kinds of device that `run --device` and `devices` offer, by name.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runner/devices/pair.h"
#include "runner/servo/device.h"

namespace palpate::runner {

struct DeviceKind {
  const char* name;
  const char* description;
  bool has_force_feedback;  ///< moves a real hand: a guard process must own it
  /// Finds what is wrong with a config before any device is touched. Called in this process,
  /// because the type of an exception is lost on its way from the guard process.
  /// \throws std::invalid_argument (usage), InputError (files)
  void (*check)(const DeviceConfig& config);
  /// What every such device can do, without opening one. What differs from device to device
  /// (force, serial, calibration) is left at its default.
  DeviceCapabilities (*nominal)(const DeviceConfig& config);
  /// May load a maker's library, which starts threads: call list_connected.
  /// \throws std::runtime_error where this computer cannot list such devices
  std::vector<ConnectedDevice> (*connected)(const DeviceConfig& config);
  /// Ready to be read and written. \throws std::runtime_error saying why not and what to do
  std::unique_ptr<Device> (*open)(const DeviceConfig& config);
  /// Of a kind that is a pair: opens one of the two, as a point; else nullptr.
  OpenEnd open_end = nullptr;
};

std::span<const DeviceKind> device_kinds();
/// The connected devices of a kind. Those with motors are listed in a process of its own, for three
/// seconds at most: a maker's library can hang, crash, or start threads before the guard forks.
/// Call it before there are other threads. \throws std::runtime_error as DeviceKind::connected, or
/// saying that the listing hung or crashed
std::vector<ConnectedDevice> list_connected(const DeviceKind& kind, const DeviceConfig& config);
/// \throws std::invalid_argument listing the known names
const DeviceKind& device_kind(const std::string& name);

}  // namespace palpate::runner
