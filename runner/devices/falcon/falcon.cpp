#include "runner/devices/falcon/falcon.h"

#include <utility>

namespace palpate::runner::falcon {

FalconDevice::FalconDevice(std::unique_ptr<FalconArm> arm, const std::string& calibration)
    : arm_(std::move(arm)) {
  capabilities_ = {"falcon",
                   3,
                   3,
                   sure_force(arm_->counts_per_torque()),
                   kMaxStiffness,
                   kMaxRate,
                   kWorkspaceRadius,
                   kResolution,
                   false,
                   arm_->serial(),
                   calibration};
}

DeviceReading FalconDevice::read() noexcept {
  const ArmReading& at = arm_->update();
  return {{at.position, at.position}, at.buttons, !at.usable(), at.trouble};
}

void FalconDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  arm_->push(device1 + device2);
}

}  // namespace palpate::runner::falcon
