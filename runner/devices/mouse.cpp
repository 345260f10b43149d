#include "runner/devices/mouse.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner::devices {
namespace {

constexpr double kReach = 0.25;       // m; limit of the tip's coordinates
constexpr double kSteepest = 1.5;     // rad; vertical, the yaw would be undefined
constexpr double kFollowTime = 0.02;  // s; low-pass filter over the pointer's steps
constexpr double kTopSpeed = 1.0;     // m/s; a pointer can jump
constexpr double kPixel = 2e-4;       // m, about one pixel of the view

Vec3 towards(const Vec3& from, const Vec3& to, double fraction, double longest) {
  Vec3 step = fraction * (to - from);
  const double length = glm::length(step);
  if (length > longest) step *= longest / length;
  return from + step;
}

}  // namespace

void StylusTarget::move(const Vec3& by) {
  tip += by;
  for (int i = 0; i < 3; ++i) tip[i] = std::clamp(tip[i], -kReach, kReach);
}

void StylusTarget::turn(double right, double up) {
  yaw = std::remainder(yaw + right, 2 * M_PI);
  pitch = std::clamp(pitch + up, -kSteepest, kSteepest);
}

void StylusTarget::point(const rendering::LineProbe& stylus) {
  const Vec3 along = stylus.tail - stylus.tip;
  const double size = glm::length(along);
  tip = {};
  move(stylus.tip);
  if (!(size > 0)) return;
  yaw = std::atan2(along.x, -along.y);
  pitch = std::clamp(std::asin(std::clamp(along.z / size, -1.0, 1.0)), -kSteepest, kSteepest);
}

Vec3 StylusTarget::axis() const {
  return {std::cos(pitch) * std::sin(yaw), -std::cos(pitch) * std::cos(yaw), std::sin(pitch)};
}

MouseStylus::MouseStylus(double length, double rate)
    : length_(length),
      follow_(1 - std::exp(-1 / (rate * kFollowTime))),
      longest_step_(kTopSpeed / rate) {
  capabilities_.name = "mouse";
  capabilities_.sensed_freedom = 5;
  capabilities_.actuated_freedom = 0;
  // It has no motors, so no force or stiffness exceeds its limits.
  capabilities_.max_force = 1000;
  capabilities_.max_stiffness = 1e6;
  capabilities_.max_rate = 10000;
  capabilities_.workspace_radius = kReach;
  capabilities_.resolution = kPixel;
  wanted_ = now_ = initial_target().stylus();
}

StylusTarget MouseStylus::initial_target() const {
  StylusTarget target;
  target.tip = {0.06, -0.04, 0.08};
  target.length = length_;
  target.yaw = 0.6;
  target.pitch = 0.7;
  return target;
}

servo::DeviceReading MouseStylus::read() noexcept {
  target_.read(wanted_);
  now_.tip = towards(now_.tip, wanted_.tip, follow_, longest_step_);
  // The tail follows separately and is then set back to the stylus' length.
  const Vec3 tail = towards(now_.tail, wanted_.tail, follow_, 2 * longest_step_);
  const Vec3 axis = tail - now_.tip;
  const double long_enough = glm::length(axis);
  if (long_enough > 1e-6 * length_) now_.tail = now_.tip + length_ / long_enough * axis;
  return {now_, 0, false};
}

}  // namespace palpate::runner::devices
