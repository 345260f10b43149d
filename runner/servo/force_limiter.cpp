#include "runner/servo/force_limiter.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner::servo {
namespace {

/// Whether both are certainly shorter than the limit, rounding included: most ticks then need no
/// square root. False if one is not finite.
bool surely_within(double limit, const Vec3& a, const Vec3& b) {
  const double least = (1 - 1e-12) * limit * limit;
  return glm::dot(a, a) < least && glm::dot(b, b) < least;
}

}  // namespace

DeviceForces ForceLimiter::apply(const Vec3& device1, const Vec3& device2) noexcept {
  double strongest = 0;  // computed only if it may be above the limit
  if (!surely_within(limits_.max_force, device1, device2)) {
    // A sum is finite only if each term is.
    const double size1 = glm::length(device1), size2 = glm::length(device2);
    if (!std::isfinite(size1 + size2)) trip();
    strongest = std::max(size1, size2);
  }
  if (fading_ && ramp_ <= ramp_step_) trip();
  if (tripped_) return {};
  ramp_ = fading_ ? ramp_ - ramp_step_ : std::min(1.0, ramp_ + ramp_step_);
  DeviceForces out;
  out.limited = strongest > limits_.max_force;
  const double scale = ramp_ * (out.limited ? limits_.max_force / strongest : 1);
  out.device1 = scale * device1;
  out.device2 = scale * device2;
  const Vec3 change1 = out.device1 - last1_, change2 = out.device2 - last2_;
  if (!surely_within(limits_.max_change, change1, change2)) {
    const double change = std::max(glm::length(change1), glm::length(change2));
    if (change > limits_.max_change) {
      const double part = limits_.max_change / change;
      out.device1 = last1_ + part * change1;
      out.device2 = last2_ + part * change2;
      out.limited = true;
    }
  }
  last1_ = out.device1;
  last2_ = out.device2;
  return out;
}

void ForceLimiter::release() noexcept {
  ramp_ = 0;
  last1_ = last2_ = Vec3(0);
}

void ForceLimiter::trip() noexcept {
  release();
  tripped_ = true;
}

}  // namespace palpate::runner::servo
