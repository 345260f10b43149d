#include "runner/servo/servo.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include "rendering/tool.h"

namespace palpate::runner::servo {
namespace {

double distance_of_segment(const rendering::LineProbe& probe) {  // from the origin, m
  const Vec3 d = probe.tail - probe.tip;
  const double d2 = glm::dot(d, d);
  const double t = d2 > 0 ? std::clamp(-glm::dot(probe.tip, d) / d2, 0.0, 1.0) : 0;
  return glm::length(probe.tip + t * d);
}

/// Distance from the origin to the nearest point of stylus or tool, m; NaN if the stylus is not
/// finite. A trial's tool begins with the roll of its first pose.
double distance_of(const TrialScene& shown, const rendering::LineProbe& probe) {
  const double stylus = distance_of_segment(probe);
  if (!std::isfinite(stylus)) return std::numeric_limits<double>::quiet_NaN();
  const rendering::Tool* const tool = shown.scene.tool();
  if (tool == nullptr || !shown.renderer->side_contact()) return stylus;
  const Vec3 d = probe.tail - probe.tip;
  const rendering::PlacedTool placed =
      rendering::place(tool, true, {probe.tip, d, rendering::tool_frame(d, nullptr, Vec3(0))});
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < placed.count; ++k) {
    const Vec3 from = probe.tip + placed.segments[k].from;
    const double distance = distance_of_segment({from, from + placed.segments[k].along});
    if (std::isnan(distance)) return distance;  // std::min would drop NaN
    least = std::min(least, distance);
  }
  return least;
}

}  // namespace

Servo::Servo(Device& device, Clock& clock, double rate, const ForceLimits& limits,
             const WorkspaceMap& workspace)
    : device_(device),
      has_motors_(has_motors(device.capabilities())),
      clock_(clock),
      period_(1 / rate),
      period_ns_(std::llround(1e9 / rate)),
      due_ns_(clock.now_ns()),
      limiter_({std::min(limits.max_force, device.capabilities().max_force), limits.max_change,
                limits.ramp},
               1 / rate),
      workspace_(workspace),
      drives_force_alone_(device.capabilities().actuated_freedom == 3),
      grip_force_(std::min(limits.max_force, device.capabilities().max_force)),
      grip_torque_(device.capabilities().max_torque) {}

void Servo::prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
                    const HomeZone& home) {
  own_ = std::make_unique<TrialScene>(scene, renderer, home);
  begin(*own_);
  due_ns_ = clock_.now_ns();
  sample_.time_ns = 0;  // so that the first period is the nominal one
}

void Servo::start() noexcept {
  const std::int64_t now = clock_.now_ns();
  due_ns_ = now - now % period_ns_ + period_ns_ / 4 + now % period_ns_ / 2;
  if (due_ns_ < now) due_ns_ += period_ns_;
}

void Servo::begin(TrialScene& shown) noexcept {
  shown_ = &shown;
  rested_ = 0;
  quality_ = {};
  strongest2_ = 0;
  limiter_.release();
  if (passivity_) passivity_->reset();
  const std::int64_t last_ns = sample_.time_ns;
  sample_ = {};
  sample_.time_ns = last_ns;
  sample_.phase = Phase::homing;
}

void Servo::clear_fault() noexcept {
  emergency_.store(false);  // cleared first, so that later requests are kept
  fade_.store(false);
  clear_trip();
}

std::span<const rendering::BodyPose> Servo::bodies() const noexcept {
  if (shown_ == nullptr || sample_.phase != Phase::feeling) return {};
  return shown_->state.motion.bodies();
}

void Servo::pull(const rendering::BodyPull& by) noexcept {
  if (shown_ == nullptr) return;
  if (rendering::MotionState* const motion = shown_->state.motion.get()) motion->pull(by);
}

bool Servo::at_home(const rendering::LineProbe& probe) noexcept {
  const HomeZone& home = shown_->home;
  // Test the hand's rest: a long virtual stylus trembles more.
  const Vec3 tip = workspace_.reach ? unstretched(*workspace_.reach, probe).tip : probe.tip;
  const bool still = rested_ > 0 && glm::length(tip - rest_tip_) <= home.stillness;
  if (!still) {
    rested_ = 0;
    rest_tip_ = tip;
  }
  const bool in_zone = home.start ? glm::length(probe.tip - *home.start) <= home.radius
                                  : distance_of(*shown_, probe) >= home.radius;
  if (!in_zone) {
    rested_ = 0;
    sample_.waiting = home.start ? Waiting::for_return : Waiting::for_distance;
    return false;
  }
  sample_.waiting = Waiting::for_rest;
  return ++rested_ >= home.rest / period_;
}

void Servo::keep_time() noexcept {
  clock_.wait_until(due_ns_);
  const std::int64_t now = clock_.now_ns();
  const std::int64_t behind = now - due_ns_;
  const std::int64_t late = behind < period_ns_ ? 0 : behind / period_ns_;  // whole ticks missed
  sample_.period_ns = sample_.time_ns > 0 ? now - sample_.time_ns : period_ns_;
  sample_.time_ns = now;
  sample_.lateness_ns = behind;
  due_ns_ += (late + 1) * period_ns_;
  late_in_a_row_ =
      late > 0 ? late_in_a_row_ + static_cast<int>(std::min<std::int64_t>(late, kMissedInARow)) : 0;
  if (sample_.phase != Phase::feeling) return;
  quality_.missed_ticks += static_cast<std::uint64_t>(late);
  quality_.longest_period_ns = std::max(quality_.longest_period_ns, sample_.period_ns);
}

void Servo::warm_up() noexcept {
  if (!warm_ || sample_.phase != Phase::feeling || !shown_->shadow) return;
  shown_->renderer->tick(shown_->scene, *shown_->shadow, sample_.probe, period_);
  sample_.warm_up_ns = clock_.now_ns() - sample_.time_ns;
}

void Servo::check(const DeviceReading& reading) noexcept {
  sample_.faults = 0;
  if (clear_.load(std::memory_order_relaxed) && clear_.exchange(false)) limiter_.clear();
  if (reading.lost) {
    sample_.faults |= servo_fault::kDeviceLost;
    limiter_.trip();
  } else {
    sample_.probe = workspace_.to_virtual(reading.stylus);
  }
  if (reading.trouble == DeviceTrouble::late) sample_.faults |= servo_fault::kOldReading;
  sample_.trouble = reading.trouble;
  sample_.buttons = reading.buttons;
  if (sample_.phase == Phase::feeling && late_in_a_row_ >= kMissedInARow) {
    sample_.faults |= servo_fault::kMissedTicks;
    if (has_motors_) limiter_.trip();
  }
}

void Servo::command(Vec3 device1, Vec3 device2) noexcept {
  if (emergency_.load()) {
    sample_.faults |= servo_fault::kEmergency;
    limiter_.trip();
  }
  if (fade_.load(std::memory_order_relaxed)) limiter_.fade();
  // A device with one grip receives the sum of both forces: the limits and the energy account use
  // it. Torque is dropped.
  if (drives_force_alone_) {
    device1 += device2;
    device2 = Vec3(0);
  }
  if (grip_torque_ > 0 && sample_.phase == Phase::feeling) {
    const rendering::LineProbe ends = workspace_.to_device(sample_.probe);
    const double force = glm::length(device1 + device2) / grip_force_;
    const double torque = glm::length(glm::cross(ends.tail - ends.tip, device2)) / grip_torque_;
    if (const double most = std::max(force, torque); most > 1) {
      device1 /= most;
      device2 /= most;
      sample_.faults |= servo_fault::kForceLimited;
    }
  }
  const DeviceForces forces =
      passivity_ ? kept_passive(device1, device2) : limiter_.apply(device1, device2);
  sample_.compute_ns = clock_.now_ns() - read_ns_;
  device_.write(forces.device1, forces.device2);
  sample_.device1 = forces.device1;
  sample_.device2 = forces.device2;
  sample_.faults |= (forces.limited ? servo_fault::kForceLimited : 0) |
                    (limiter_.tripped() ? servo_fault::kTripped : 0);
}

DeviceForces Servo::kept_passive(const Vec3& device1, const Vec3& device2) noexcept {
  if (sample_.phase != Phase::feeling || limiter_.tripped()) {
    passivity_->reset();
    return limiter_.apply(device1, device2);
  }
  ForceLimiter preview = limiter_;  // to compute the limits' effect on the scene's forces alone
  const rendering::LineProbe ends = workspace_.to_device(sample_.probe);
  const DeviceForces damping =
      passivity_->damping({ends.tip, ends.tail}, preview.apply(device1, device2));
  DeviceForces forces = limiter_.apply(device1 + damping.device1, device2 + damping.device2);
  passivity_->commanded(forces);
  return forces;
}

const Sample& Servo::tick() noexcept {
  keep_time();
  warm_up();
  const DeviceReading reading = device_.read();
  read_ns_ = clock_.now_ns();
  check(reading);
  if (sample_.phase == Phase::homing && !reading.lost && at_home(sample_.probe)) {
    sample_.phase = Phase::feeling;
    sample_.waiting = Waiting::nothing;
    sample_.tick = 0;
  } else if (sample_.phase == Phase::feeling) {
    ++sample_.tick;
  }
  if (sample_.phase != Phase::feeling) {
    command(Vec3(0), Vec3(0));
    limiter_.release();  // the ramp begins when forces go on
    return sample_;
  }
  if (shown_->ramp != nullptr && !shown_->ramp->advance(shown_->scene, period_))
    shown_->ramp = nullptr;
  // Construct it in place: an assignment would copy it.
  std::destroy_at(&sample_.rendering);
  ::new (&sample_.rendering) rendering::Rendering(shown_->renderer->tick(
      shown_->scene, shown_->state, sample_.probe, static_cast<double>(sample_.period_ns) * 1e-9));
  if (workspace_.reach) sample_.rendering = rendering::felt(*workspace_.reach, sample_.rendering);
  sample_.bodies = static_cast<std::uint8_t>(bodies().size());
  sample_.faults |= sample_.rendering.faults;
  const std::uint32_t ends = rendering::render_fault::kNonFinite |
                             (has_motors_ ? rendering::render_fault::kSoftStalled : 0);
  if (sample_.rendering.faults & ends) limiter_.trip();
  command(sample_.rendering.device1, sample_.rendering.device2);
  ++quality_.ticks;
  quality_.faults |= sample_.faults;
  quality_.longest_compute_ns = std::max(quality_.longest_compute_ns, sample_.compute_ns);
  const Vec3 on_hand = sample_.device1 + sample_.device2;
  strongest2_ = std::max(strongest2_, glm::dot(on_hand, on_hand));
  return sample_;
}

ServoQuality Servo::stop() noexcept {
  limiter_.release();
  device_.write(Vec3(0), Vec3(0));
  sample_.phase = Phase::idle;
  sample_.waiting = Waiting::nothing;
  sample_.device1 = sample_.device2 = Vec3(0);
  sample_.rendering = {};
  sample_.bodies = 0;
  shown_ = nullptr;
  quality_.max_force = std::sqrt(strongest2_);
  return std::exchange(quality_, {});
}

}  // namespace palpate::runner::servo
