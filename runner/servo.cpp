#include "runner/servo.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace palpate {
namespace {

double distance_of_segment(const LineProbe& probe) {  // from the origin, m
  const Vec3 d = probe.tail - probe.tip;
  const double d2 = glm::dot(d, d);
  const double t = d2 > 0 ? std::clamp(-glm::dot(probe.tip, d) / d2, 0.0, 1.0) : 0;
  return glm::length(probe.tip + t * d);
}

}  // namespace

Servo::Servo(Device& device, Clock& clock, double rate, const ForceLimits& limits,
             const WorkspaceMap& workspace)
    : device_(device),
      clock_(clock),
      period_(1 / rate),
      period_ns_(std::llround(1e9 / rate)),
      due_ns_(clock.now_ns()),
      limiter_({std::min(limits.max_force, device.capabilities().max_force), limits.max_change,
                limits.ramp},
               1 / rate),
      workspace_(workspace) {}

void Servo::prepare(const Scene& scene, const Renderer& renderer, const HomeZone& home) {
  scene_ = scene;
  renderer_ = &renderer;
  state_ = scene_->initial_state();
  home_ = home;
  rested_ = 0;
  quality_ = {};
  limiter_.release();
  sample_ = {};
  sample_.phase = Phase::homing;
  due_ns_ = clock_.now_ns();
}

bool Servo::at_home(const LineProbe& probe) noexcept {
  const bool still = rested_ > 0 && glm::length(probe.tip - rest_tip_) <= home_.stillness;
  if (!still) {
    rested_ = 0;
    rest_tip_ = probe.tip;
  }
  if (!(distance_of_segment(probe) >= home_.radius)) {
    rested_ = 0;
    return false;
  }
  return ++rested_ >= home_.rest / period_;
}

void Servo::keep_time() noexcept {
  clock_.wait_until(due_ns_);
  const std::int64_t now = clock_.now_ns();
  const std::int64_t late = (now - due_ns_) / period_ns_;  // whole ticks that were missed
  sample_.period_ns = sample_.time_ns > 0 ? now - sample_.time_ns : period_ns_;
  sample_.time_ns = now;
  due_ns_ += (late + 1) * period_ns_;
  late_in_a_row_ =
      late > 0 ? late_in_a_row_ + static_cast<int>(std::min<std::int64_t>(late, kMissedInARow)) : 0;
  if (sample_.phase != Phase::feeling) return;
  quality_.missed_ticks += static_cast<std::uint64_t>(late);
  quality_.longest_period_ns = std::max(quality_.longest_period_ns, sample_.period_ns);
}

const Sample& Servo::tick() noexcept {
  keep_time();
  sample_.faults = 0;
  const DeviceReading reading = device_.read();
  if (reading.lost) {
    sample_.faults |= servo_fault::kDeviceLost;
    limiter_.trip();
  } else {
    sample_.probe = {workspace_.to_virtual(reading.stylus.tip),
                     workspace_.to_virtual(reading.stylus.tail)};
  }
  sample_.buttons = reading.buttons;
  if (late_in_a_row_ >= kMissedInARow) {
    sample_.faults |= servo_fault::kMissedTicks;
    limiter_.trip();
  }
  if (sample_.phase == Phase::homing && !reading.lost && at_home(sample_.probe)) {
    sample_.phase = Phase::feeling;
    sample_.tick = 0;
  } else if (sample_.phase == Phase::feeling) {
    ++sample_.tick;
  }
  if (sample_.phase != Phase::feeling) {
    device_.write(Vec3(0), Vec3(0));
    return sample_;
  }
  sample_.rendering = renderer_->tick(*scene_, state_, sample_.probe,
                                      static_cast<double>(sample_.period_ns) * 1e-9);
  if (sample_.rendering.faults & render_fault::kNonFinite) limiter_.trip();
  const DeviceForces forces = limiter_.apply(sample_.rendering.device1, sample_.rendering.device2);
  device_.write(forces.device1, forces.device2);
  sample_.device1 = forces.device1;
  sample_.device2 = forces.device2;
  sample_.faults |= sample_.rendering.faults | (forces.limited ? servo_fault::kForceLimited : 0) |
                    (limiter_.tripped() ? servo_fault::kTripped : 0);
  ++quality_.ticks;
  quality_.faults |= sample_.faults;
  quality_.max_force = std::max(quality_.max_force, glm::length(forces.device1 + forces.device2));
  return sample_;
}

ServoQuality Servo::stop() noexcept {
  limiter_.release();
  device_.write(Vec3(0), Vec3(0));
  sample_.phase = Phase::idle;
  return std::exchange(quality_, {});
}

}  // namespace palpate
