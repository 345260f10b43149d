#pragma once
// One Novint Falcon, or two at the ends of a stylus, as a device, and the functions of their rows
// in the registry of devices: these open Falcons from a DeviceConfig; only homing remains to be
// done. All calls from one thread.

#include <memory>
#include <string>
#include <vector>

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "runner/servo/device.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

/// Position and force of one point, no rotation.
class FalconDevice final : public servo::Device {
 public:
  /// \param calibration  state of its force calibration, for DeviceCapabilities
  explicit FalconDevice(std::unique_ptr<FalconDriver> driver, const std::string& calibration = "");

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Tip and tail are both the grip: the device senses no axis.
  servo::DeviceReading read() noexcept override;
  /// Both forces act on the one grip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  void reopen() override { driver_->reopen(); }
  servo::DeviceTimes times() const noexcept override { return driver_->times(); }

  FalconDriver& driver() { return *driver_; }

 private:
  std::unique_ptr<FalconDriver> driver_;
  servo::DeviceCapabilities capabilities_;
};

/// Two Falcons that hold the ends of a stylus, like the two Phantoms of Ho, Basdogan & Srinivasan
/// (2000), section 2: five degrees of freedom, sensed and actuated. World frame: the tip's device.
class Falcon2Device final : public servo::Device {
 public:
  Falcon2Device(std::unique_ptr<FalconDriver> tip, std::unique_ptr<FalconDriver> tail,
                const StylusFromEnds& stylus, const std::string& calibration = "");

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Lost if either device is lost or the distance of the ends differs from the stylus' length.
  /// Buttons of the tip's grip are bits 0 to 3, of the tail's 4 to 7.
  servo::DeviceReading read() noexcept override;
  /// \param device1, device2  N, world frame: eq. (1)'s forces at tip and tail.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  /// Both ends command zero force during that time.
  void reopen() override;
  servo::DeviceTimes times() const noexcept override {
    return servo::later_of(tip_->times(), tail_->times());
  }

  FalconDriver& tip() { return *tip_; }
  FalconDriver& tail() { return *tail_; }
  const StylusFromEnds& stylus() const { return stylus_; }

 private:
  std::unique_ptr<FalconDriver> tip_, tail_;
  StylusFromEnds stylus_;
  servo::DeviceCapabilities capabilities_;
  bool lost_ = true;
};

/// Connected Falcons. \throws TransportError if USB cannot be used.
std::vector<servo::ConnectedDevice> connected_falcons(const servo::DeviceConfig& config);

/// See DeviceKind::nominal.
servo::DeviceCapabilities nominal_falcon(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal_falcon2(const servo::DeviceConfig& config);

/// See DeviceKind::check.
void check_falcon(const servo::DeviceConfig& config);
void check_falcon2(const servo::DeviceConfig& config);

/// One Falcon. Its capabilities' `calibration` is empty if none is stored. It begins with "stale"
/// if too old, with "implausible" if its scale is not used. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon(const servo::DeviceConfig& config);

/// The two Falcons of config.serials, the one at the stylus' tip first. config.calibration must
/// have their registration. \throws TransportError, InputError.
std::unique_ptr<servo::Device> open_falcon2(const servo::DeviceConfig& config);

}  // namespace palpate::runner::devices::falcon
