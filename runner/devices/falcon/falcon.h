#pragma once
// A Novint Falcon as a device: position and force of one point, no rotation. All calls from one
// thread.

#include <memory>
#include <string>

#include "runner/devices/falcon/driver.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

class FalconDevice final : public Device {
 public:
  /// \param calibration  state of its force calibration, for DeviceCapabilities
  explicit FalconDevice(std::unique_ptr<FalconDriver> driver, const std::string& calibration = "");

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Tip and tail are both the grip: the device senses no axis.
  DeviceReading read() noexcept override;
  /// Both forces act on the one grip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  void reopen() override { driver_->reopen(); }

  FalconDriver& driver() { return *driver_; }

 private:
  std::unique_ptr<FalconDriver> driver_;
  DeviceCapabilities capabilities_;
};

}  // namespace palpate::runner::falcon
