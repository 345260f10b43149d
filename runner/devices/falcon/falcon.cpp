#include "runner/devices/falcon/falcon.h"

#include <algorithm>
#include <utility>

namespace palpate::runner::devices::falcon {

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

servo::DeviceReading FalconDevice::read() noexcept {
  const DriverReading& at = driver_->update();
  return {{at.position, at.position}, at.buttons, !at.usable(), at.trouble};
}

void FalconDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  driver_->push(device1 + device2);
}

Falcon2Device::Falcon2Device(std::unique_ptr<FalconDriver> tip, std::unique_ptr<FalconDriver> tail,
                             const StylusFromEnds& stylus, const std::string& calibration)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  capabilities_ = {"falcon2",
                   5,
                   5,
                   std::min(guaranteed_force(tip_->counts_per_torque()),
                            guaranteed_force(tail_->counts_per_torque())),
                   kMaxStiffness,
                   kMaxRate,
                   kWorkspaceRadius,
                   kResolution,
                   false,
                   tip_->serial() + ", " + tail_->serial(),
                   calibration};
}

servo::DeviceReading Falcon2Device::read() noexcept {
  const DriverReading& tip = tip_->update();
  const DriverReading& tail = tail_->update();
  servo::DeviceTrouble trouble = tip.trouble;
  if (tip.usable() && tail.trouble != servo::DeviceTrouble::none) trouble = tail.trouble;
  lost_ = !tip.usable() || !tail.usable();
  if (!lost_ && !stylus_.update(tip.position, tail.position)) {
    lost_ = true;
    trouble = servo::DeviceTrouble::apart;
  }
  return {stylus_.stylus(), static_cast<std::uint8_t>(tip.buttons | tail.buttons << 4), lost_,
          trouble};
}

void Falcon2Device::reopen() {
  // Halt both: a device keeps its last command while it receives no packets.
  tip_->halt();
  tail_->halt();
  tip_->reopen();
  tail_->reopen();
}

void Falcon2Device::write(const Vec3& device1, const Vec3& device2) noexcept {
  // Push with both or none: a force from one device alone would turn the stylus.
  tip_->push(lost_ ? Vec3(0) : device1);
  tail_->push(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2));
}

}  // namespace palpate::runner::devices::falcon
