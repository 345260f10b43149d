#include "runner/devices/falcon/falcon.h"

#include <utility>

namespace palpate::runner::falcon {

FalconDevice::FalconDevice(std::unique_ptr<FalconDriver> driver, const std::string& calibration)
    : driver_(std::move(driver)) {
  capabilities_ = {"falcon",
                   3,
                   3,
                   guaranteed_force(driver_->counts_per_torque()),
                   kMaxStiffness,
                   kMaxRate,
                   kWorkspaceRadius,
                   kResolution,
                   false,
                   driver_->serial(),
                   calibration};
}

DeviceReading FalconDevice::read() noexcept {
  const DriverReading& at = driver_->update();
  return {{at.position, at.position}, at.buttons, !at.usable(), at.trouble};
}

void FalconDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  driver_->push(device1 + device2);
}

}  // namespace palpate::runner::falcon
