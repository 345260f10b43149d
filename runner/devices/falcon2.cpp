#include "runner/devices/falcon2.h"

#include <utility>

namespace palpate::falcon {

Falcon2Device::Falcon2Device(std::unique_ptr<FalconArm> tip, std::unique_ptr<FalconArm> tail,
                             const StylusFromEnds& stylus, double max_force)
    : tip_(std::move(tip)), tail_(std::move(tail)), stylus_(stylus) {
  capabilities_ = {"falcon2",        5,           5,    max_force, kMaxStiffness, kMaxRate,
                   kWorkspaceRadius, kResolution, false};
}

DeviceReading Falcon2Device::read() noexcept {
  const ArmReading& tip = tip_->update();
  const ArmReading& tail = tail_->update();
  const bool both = tip.trouble == ArmTrouble::none && tail.trouble == ArmTrouble::none;
  lost_ = !both || !stylus_.update(tip.position, tail.position);
  return {stylus_.stylus(), static_cast<std::uint8_t>(tip.buttons | tail.buttons << 4), lost_};
}

void Falcon2Device::write(const Vec3& device1, const Vec3& device2) noexcept {
  // One device alone would turn the stylus: both push or neither.
  tip_->push(lost_ ? Vec3(0) : device1);
  tail_->push(lost_ ? Vec3(0) : stylus_.to_tail_frame(device2));
}

}  // namespace palpate::falcon
