#include "runner/devices/mouse.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr double kReach = 0.25;       // m; the tip goes no further from the centre, on any axis
constexpr double kSteepest = 1.5;     // rad; straight up or down the yaw would be lost
constexpr double kFollowTime = 0.02;  // s; smooths the pointer's steps of a frame each
constexpr double kTopSpeed = 1.0;     // m/s; a pointer can jump, a hand cannot
constexpr double kPixel = 2e-4;       // m, about what a pixel of the view stands for

Vec3 towards(const Vec3& from, const Vec3& to, double share, double longest) {
  Vec3 step = share * (to - from);
  const double length = glm::length(step);
  if (length > longest) step *= longest / length;
  return from + step;
}

}  // namespace

void MouseHand::move(double across, double up, double towards) {
  tip += Vec3(across, up, towards);
  for (int i = 0; i < 3; ++i) tip[i] = std::clamp(tip[i], -kReach, kReach);
}

void MouseHand::turn(double right, double up) {
  yaw = std::remainder(yaw + right, 2 * M_PI);
  pitch = std::clamp(pitch + up, -kSteepest, kSteepest);
}

Vec3 MouseHand::axis() const {
  return {std::cos(pitch) * std::sin(yaw), std::sin(pitch), std::cos(pitch) * std::cos(yaw)};
}

MouseStylus::MouseStylus(double length, double rate)
    : length_(length),
      follow_(1 - std::exp(-1 / (rate * kFollowTime))),
      longest_step_(kTopSpeed / rate) {
  capabilities_.name = "mouse";
  capabilities_.sensed_freedom = 5;
  capabilities_.actuated_freedom = 0;
  // Nothing is felt, so no force or stiffness is too much for it.
  capabilities_.max_force = 1000;
  capabilities_.max_stiffness = 1e6;
  capabilities_.max_rate = 10000;
  capabilities_.workspace_radius = kReach;
  capabilities_.resolution = kPixel;
  wanted_ = now_ = resting_hand().stylus();
}

MouseHand MouseStylus::resting_hand() const {
  MouseHand hand;
  hand.tip = {0.06, 0.08, 0.04};
  hand.length = length_;
  hand.yaw = 0.6;
  hand.pitch = 0.7;
  return hand;
}

DeviceReading MouseStylus::read() noexcept {
  target_.read(wanted_);
  now_.tip = towards(now_.tip, wanted_.tip, follow_, longest_step_);
  // The axis follows on its own, or the stylus would shrink on the way.
  const Vec3 tail = towards(now_.tail, wanted_.tail, follow_, 2 * longest_step_);
  const Vec3 axis = tail - now_.tip;
  const double long_enough = glm::length(axis);
  if (long_enough > 1e-6 * length_) now_.tail = now_.tip + length_ / long_enough * axis;
  return {now_, 0, false};
}

}  // namespace palpate::runner
