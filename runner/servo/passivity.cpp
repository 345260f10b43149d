#include "runner/servo/passivity.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner::servo {
namespace {

/// The part of `motion` along the force. Only this part is damped, so that a stylus slides freely
/// along a face.
Vec3 part_along(Vec3& towards, const Vec3& force, const Vec3& motion) {
  const double size = glm::length(force);
  if (size > 0) towards = force / size;
  return glm::dot(motion, towards) * towards;
}

}  // namespace

DeviceForces PassivityController::damping(const Ends& at, const DeviceForces& scene) noexcept {
  DeviceForces out;
  const Vec3 way1 = at.tip - last_.tip, way2 = at.tail - last_.tail;
  const Vec3 moved1 = part_along(towards1_, scene.device1, way1);
  const Vec3 moved2 = part_along(towards2_, scene.device2, way2);
  if (started_) {
    const double fed = glm::dot(commanded_.device1, way1) + glm::dot(commanded_.device2, way2);
    const double due = 0.5 * (glm::dot(scene_.device1 + scene.device1, way1) +
                              glm::dot(scene_.device2 + scene.device2, way2));
    excess_ = std::max(0.0, excess_ + fed - due);
    const double moved = glm::dot(moved1, moved1) + glm::dot(moved2, moved2);  // m^2
    if (excess_ > 0 && moved > 0) {
      // At this speed, damping b dissipates b v^2 T = b moved / T in the next tick.
      const double b = std::min(excess_ * tick_ / moved, settings_.most_damping);
      out.device1 = -b / tick_ * moved1;
      out.device2 = -b / tick_ * moved2;
    }
  }
  started_ = true;
  last_ = at;
  scene_ = scene;
  // Poses are not finite: add no force and reset the account.
  if (!std::isfinite(excess_ + glm::dot(way1, way1) + glm::dot(way2, way2))) {
    reset();
    out = {};
  }
  return out;
}

void PassivityController::reset() noexcept {
  started_ = false;
  last_ = {};
  commanded_ = scene_ = {};
  towards1_ = towards2_ = Vec3(0);
  excess_ = 0;
}

}  // namespace palpate::runner::servo
