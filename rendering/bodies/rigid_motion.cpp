#include "rendering/bodies/rigid_motion.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>

namespace palpate::rendering {
namespace {

/// Of an orientation whose spin is that of the momentum.
Quat rate_of_turn(const BodyInertia& inertia, const Vec3& spin_momentum, const Quat& q) {
  const Vec3 spin = inertia.per_inertia * (glm::conjugate(q) * spin_momentum);
  return 0.5 * (q * Quat(0, spin.x, spin.y, spin.z));
}

Quat runge_kutta(const BodyInertia& inertia, const Vec3& momentum, const Quat& q, double step) {
  // Stages are not of unit length: the rotation of the momentum is scaled back by its square.
  const auto rate = [&](const Quat& at) {
    return rate_of_turn(inertia, momentum, glm::normalize(at)) * glm::length(at);
  };
  const Quat a = rate(q);
  const Quat b = rate(q + 0.5 * step * a);
  const Quat c = rate(q + 0.5 * step * b);
  const Quat d = rate(q + step * c);
  return glm::normalize(q + step / 6 * (a + 2.0 * b + 2.0 * c + d));
}

}  // namespace

BodyInertia inertia_of(const MassProperties& properties) {
  const double size =
      properties.inertia[0][0] + properties.inertia[1][1] + properties.inertia[2][2];
  const double determinant = glm::determinant(properties.inertia);
  if (!(properties.mass > 0) || !(determinant > 1e-18 * size * size * size) ||
      !std::isfinite(determinant))
    throw std::invalid_argument("a body's mass and moments of inertia must be above 0");
  BodyInertia out;
  out.mass = properties.mass;
  out.per_mass = 1 / properties.mass;
  out.inertia = properties.inertia;
  out.per_inertia = glm::inverse(properties.inertia);
  return out;
}

Vec3 spin_of(const BodyInertia& inertia, const BodyMotion& motion) {
  return motion.orientation *
         (inertia.per_inertia * (glm::conjugate(motion.orientation) * motion.spin_momentum));
}

Vec3 spin_momentum_of(const BodyInertia& inertia, const Quat& orientation, const Vec3& spin) {
  return orientation * (inertia.inertia * (glm::conjugate(orientation) * spin));
}

Mat3 world_per_inertia(const BodyInertia& inertia, const Quat& orientation) {
  const Mat3 axes = glm::mat3_cast(orientation);
  return axes * inertia.per_inertia * glm::transpose(axes);
}

double kinetic_energy(const BodyInertia& inertia, const BodyMotion& motion) {
  return 0.5 * (inertia.mass * glm::dot(motion.velocity, motion.velocity) +
                glm::dot(motion.spin_momentum, spin_of(inertia, motion)));
}

Vec3 velocity_at(const Vec3& spin, const BodyMotion& motion, const Vec3& point) {
  return motion.velocity + glm::cross(spin, point - motion.centre);
}

Quat turned(const Quat& orientation, const Vec3& turn) {
  const double angle = glm::length(turn);
  if (!(angle > 0)) return orientation;
  const Vec3 axis = std::sin(0.5 * angle) / angle * turn;
  return glm::normalize(Quat(std::cos(0.5 * angle), axis.x, axis.y, axis.z) * orientation);
}

Quat turned_freely(const BodyInertia& inertia, const Vec3& spin_momentum, Quat orientation,
                   double duration) {
  constexpr double kLargestStep = 0.02;  // rad
  constexpr double kMostSteps = 64;
  if (glm::dot(spin_momentum, spin_momentum) == 0 || duration == 0) return orientation;
  const Vec3 spin = inertia.per_inertia * (glm::conjugate(orientation) * spin_momentum);
  const double steps =
      std::clamp(std::ceil(glm::length(spin) * duration / kLargestStep), 1.0, kMostSteps);
  for (int i = 0; i < static_cast<int>(steps); ++i)
    orientation = runge_kutta(inertia, spin_momentum, orientation, duration / steps);
  return orientation;
}

void move_freely(const BodyInertia& inertia, const Vec3& gravity, double damping, double duration,
                 BodyMotion& motion) {
  if (damping > 0) {
    // v' = g - c v
    const double left = std::exp(-damping * duration);
    const Vec3 terminal = gravity / damping;
    const double effective = -std::expm1(-damping * duration) / damping;
    motion.centre += terminal * (duration - effective) + motion.velocity * effective;
    motion.velocity = terminal + left * (motion.velocity - terminal);
    // A momentum that shrinks in place turns the body as the momentum of the start does in the
    // shortened time.
    motion.orientation =
        turned_freely(inertia, motion.spin_momentum, motion.orientation, effective);
    motion.spin_momentum *= left;
    return;
  }
  motion.centre += duration * motion.velocity + (0.5 * duration * duration) * gravity;
  motion.velocity += duration * gravity;
  motion.orientation = turned_freely(inertia, motion.spin_momentum, motion.orientation, duration);
}

}  // namespace palpate::rendering
