#include "runner/devices/falcon/falcon2.h"

#include <algorithm>
#include <utility>

namespace palpate::runner::falcon {

Falcon2Device::Falcon2Device(std::unique_ptr<FalconArm> tip, std::unique_ptr<FalconArm> tail,
                             const StylusFromEnds& stylus, const std::string& calibration)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  capabilities_ = {
      "falcon2",
      5,
      5,
      std::min(sure_force(tip_->counts_per_torque()), sure_force(tail_->counts_per_torque())),
      kMaxStiffness,
      kMaxRate,
      kWorkspaceRadius,
      kResolution,
      false,
      tip_->serial() + ", " + tail_->serial(),
      calibration};
}

DeviceReading Falcon2Device::read() noexcept {
  const ArmReading& tip = tip_->update();
  const ArmReading& tail = tail_->update();
  DeviceTrouble trouble = tip.trouble;
  if (tip.usable() && tail.trouble != DeviceTrouble::none) trouble = tail.trouble;
  lost_ = !tip.usable() || !tail.usable();
  if (!lost_ && !stylus_.update(tip.position, tail.position)) {
    lost_ = true;
    trouble = DeviceTrouble::apart;
  }
  return {stylus_.stylus(), static_cast<std::uint8_t>(tip.buttons | tail.buttons << 4), lost_,
          trouble};
}

void Falcon2Device::reopen() {
  // The other one holds its last command while nobody speaks to it.
  tip_->halt();
  tail_->halt();
  tip_->reopen();
  tail_->reopen();
}

void Falcon2Device::write(const Vec3& device1, const Vec3& device2) noexcept {
  // One device alone would turn the stylus: both push or neither.
  tip_->push(lost_ ? Vec3(0) : device1);
  tail_->push(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2));
}

}  // namespace palpate::runner::falcon
