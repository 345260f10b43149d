#pragma once
// The kinds of device that `run --device` and `devices` offer, by name.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"

namespace palpate::runner::devices {

/// Two devices of one model that hold the ends of a stylus, each a point with forces, like the two
/// Phantoms of Ho, Basdogan & Srinivasan (2000), section 2: five degrees of freedom, sensed and
/// driven. World frame: the tip's device.
class PairDevice final : public servo::Device {
 public:
  /// \param name         name of the kind
  /// \param calibration  as in DeviceCapabilities
  PairDevice(std::unique_ptr<servo::Device> tip, std::unique_ptr<servo::Device> tail,
             const StylusFromEnds& stylus, const char* name, const std::string& calibration);

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Lost if either device is lost or the distance of the ends differs from the stylus's length.
  /// Buttons of the tip's grip are bits 0 to 3, of the tail's 4 to 7.
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  /// Both ends command zero force first.
  void reopen() override;
  servo::DeviceTimes times() const noexcept override {
    return servo::later_of(tip_->times(), tail_->times());
  }

 private:
  std::unique_ptr<servo::Device> tip_, tail_;
  StylusFromEnds stylus_;
  servo::DeviceCapabilities capabilities_;
  bool lost_ = true;
};

/// One device of a pair, as a point.
using OpenEnd = std::unique_ptr<servo::Device> (*)(const servo::DeviceConfig& config);

/// Capabilities of a pair. \param end  those of each device
servo::DeviceCapabilities pair_of(const servo::DeviceCapabilities& end, const char* name);

struct DeviceKind {
  const char* name;
  const char* description;
  bool has_force_feedback;  ///< moves a real hand: a guard process must own it
  /// Checks a config before any device is opened. Called in this process, because exceptions lose
  /// their type on the way from the guard process.
  /// \throws std::invalid_argument (usage), InputError (files)
  void (*check)(const servo::DeviceConfig& config);
  /// Capabilities common to all such devices, without opening one. Those that differ between
  /// devices (force, serial, calibration) keep their defaults.
  servo::DeviceCapabilities (*nominal)(const servo::DeviceConfig& config);
  /// May load a maker's library, which starts threads: call list_connected.
  /// \throws std::runtime_error if this computer cannot list such devices
  std::vector<servo::ConnectedDevice> (*connected)(const servo::DeviceConfig& config);
  /// Opens a device, ready to be read and written. \throws std::runtime_error with the reason and
  /// the remedy
  std::unique_ptr<servo::Device> (*open)(const servo::DeviceConfig& config);
  /// For a pair: opens one of the two as a point; else nullptr.
  OpenEnd open_end = nullptr;
  /// Where the device can move its own arm to find its zero, else nullptr. Loads a maker's library:
  /// call calibrate_by_itself. \return what was done, in words. \throws std::runtime_error
  std::string (*move_to_calibrate)(const servo::DeviceConfig& config) = nullptr;
  bool force_by_weights = false;  ///< the scale of its force is measured with known weights
};

std::span<const DeviceKind> device_kinds();
/// The connected devices of a kind. Those with motors are listed in a separate process, for at most
/// three seconds: a maker's library can hang, crash, or start threads before the guard forks. Call
/// it before creating other threads. \throws std::runtime_error as DeviceKind::connected, or
/// because the listing hung or crashed
std::vector<servo::ConnectedDevice> list_connected(const DeviceKind& kind,
                                                   const servo::DeviceConfig& config);
/// Lets a device with move_to_calibrate do so, in a separate process whose end is the end of its
/// forces, for at most a minute. \throws std::runtime_error as move_to_calibrate, or because it
/// hung or crashed
std::string calibrate_by_itself(const DeviceKind& kind, const servo::DeviceConfig& config);
/// \throws std::invalid_argument listing the known names
const DeviceKind& device_kind(const std::string& name);

}  // namespace palpate::runner::devices
