#include "runner/display/pointer_hand.h"

namespace palpate {
namespace {

constexpr double kNotch = 0.004;           // m
constexpr double kReachPerPixel = 0.0004;  // m
constexpr double kTurnPerPixel = 0.006;    // rad

}  // namespace

PointerHand::PointerHand(MouseStylus& device, const WorkspaceMap& workspace)
    : device_(device), workspace_(workspace), hand_(device.resting_hand()) {
  hand_.tip += workspace_.centre;
  device_.aim(hand_.stylus());
}

void PointerHand::step(const PointerMotion& pointer, const Camera& camera) {
  if (!pointer.over) {
    was_over_ = false;
    return;
  }
  const auto tip = [&] { return glm::vec3(workspace_.to_virtual(hand_.tip)); };
  const auto move_to = [&](const Vec3& point) {
    const Vec3 by = workspace_.to_device(point) - hand_.tip;
    hand_.move(by.x, by.y, by.z);
  };
  const bool entered = !was_over_;
  if (entered) held_ = {0, 0};
  was_over_ = true;
  double reach = pointer.wheel * kNotch;
  if (pointer.orbit) {
    held_ = pointer.at - camera.pixel(tip());
  } else if (pointer.turn) {
    hand_.turn(kTurnPerPixel * pointer.moved.x, -kTurnPerPixel * pointer.moved.y);
    held_ = pointer.at - camera.pixel(tip());
  } else if (pointer.reach) {
    reach -= kReachPerPixel * pointer.moved.y;
  } else if (entered || pointer.moved != glm::vec2(0, 0)) {
    move_to(Vec3(camera.under(pointer.at - held_, tip())));
  }
  if (reach != 0) {
    move_to(Vec3(tip() - static_cast<float>(reach) * camera.towards_viewer()));
    held_ = pointer.at - camera.pixel(tip());
  }
  device_.aim(hand_.stylus());
}

}  // namespace palpate
