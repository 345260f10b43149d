#include "runner/display/pointer_hand.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace palpate::runner {
namespace {

constexpr double kNotch = 0.001;        // m
constexpr double kNotchBeside = 0.004;  // m
constexpr double kFirstPress = 0.0015;  // m; about 1 N at the usual stiffness
constexpr double kBeside = 0.08;        // m, of the plane; outside of the usual home zones
constexpr double kMostPress = 0.03, kFarthest = 0.2;  // m
constexpr double kReachPerPixel = 0.0004;             // m
constexpr double kTurnPerPixel = 0.006;               // rad

}  // namespace

PointerHand::PointerHand(MouseStylus& device, const WorkspaceMap& workspace)
    : device_(device),
      workspace_(workspace),
      hand_(device.initial_target()),
      press_(kFirstPress),
      off_(kBeside) {
  hand_.tip += workspace_.centre;
  device_.set_target(hand_.stylus());
}

Vec3 PointerHand::wanted(const glm::vec2& pixel, const Camera& camera, const LineOfSight& object) {
  const glm::vec3 eye = camera.eye();
  const glm::vec3 along = glm::normalize(camera.under(pixel, glm::vec3(0)) - eye);
  const std::optional<glm::vec3> surface = object(eye, along);
  if (touches_ && !surface) press_ = kFirstPress;
  touches_ = surface.has_value();
  if (surface) return Vec3(*surface) + press_ * Vec3(along);
  return Vec3(camera.under(pixel, static_cast<float>(off_) * camera.towards_viewer()));
}

void PointerHand::step(const PointerMotion& pointer, const Camera& camera,
                       const LineOfSight& object) {
  if (!pointer.over) {
    was_over_ = false;
    return;
  }
  const bool entered = !was_over_;
  if (entered) held_ = {0, 0};
  was_over_ = true;
  const auto tip = [&] { return glm::vec3(workspace_.to_virtual(hand_.tip)); };
  const auto follow = [&] {
    const Vec3 to = workspace_.to_device(wanted(pointer.at - held_, camera, object));
    const Vec3 by = to - hand_.tip;
    hand_.move(by.x, by.y, by.z);
  };
  const double notches =
      pointer.wheel - (pointer.reach ? kReachPerPixel / kNotch * pointer.moved.y : 0);
  if (touches_) {
    press_ = std::clamp(press_ + kNotch * notches, 0.0, kMostPress);
  } else {
    off_ = std::clamp(off_ - kNotchBeside * notches, -kFarthest, kFarthest);
  }
  if (pointer.orbit) {
    held_ = pointer.at - camera.pixel(tip());
  } else if (pointer.turn) {
    hand_.turn(kTurnPerPixel * pointer.moved.x, -kTurnPerPixel * pointer.moved.y);
    held_ = pointer.at - camera.pixel(tip());
  } else if (entered || notches != 0 || (!pointer.reach && pointer.moved != glm::vec2(0, 0))) {
    follow();
  }
  device_.set_target(hand_.stylus());
}

}  // namespace palpate::runner
