#pragma once
// A Novint Falcon: position and force of one point, no rotation. Needs one thread.

#include <memory>
#include <string>

#include "runner/devices/falcon/arm.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

class FalconDevice final : public Device {
 public:
  /// \param calibration  what is known of its force scale, for DeviceCapabilities
  explicit FalconDevice(std::unique_ptr<FalconArm> arm, const std::string& calibration = "");

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Tip and tail are both the grip: the device senses no axis.
  DeviceReading read() noexcept override;
  /// Both forces pull at the one grip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;

  void reopen() override { arm_->reopen(); }

  FalconArm& arm() { return *arm_; }

 private:
  std::unique_ptr<FalconArm> arm_;
  DeviceCapabilities capabilities_;
};

}  // namespace palpate::runner::falcon
