#include "rendering/bodies/rigid_motion.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>

namespace palpate::rendering {
namespace {

/// Rate of an orientation for the spin of the momentum, times the quaternion's length: stages of
/// Runge-Kutta do not have unit length.
Quat rate_of_turn(const BodyInertia& inertia, const Vec3& spin_momentum, const Quat& q) {
  const double per_length2 = 1 / glm::dot(q, q);
  const Vec3 v(q.x, q.y, q.z);
  const Vec3 across = glm::cross(spin_momentum, v);  // q* L q / |q|^2, by hand
  const Vec3 local = spin_momentum + 2 * per_length2 * (q.w * across + glm::cross(across, v));
  const Vec3 half = 0.5 * (inertia.per_inertia * local);
  return {-glm::dot(v, half), q.w * half + glm::cross(v, half)};
}

Quat runge_kutta(const BodyInertia& inertia, const Vec3& momentum, const Quat& q, double step) {
  const Quat a = rate_of_turn(inertia, momentum, q);
  const Quat b = rate_of_turn(inertia, momentum, q + 0.5 * step * a);
  const Quat c = rate_of_turn(inertia, momentum, q + 0.5 * step * b);
  const Quat d = rate_of_turn(inertia, momentum, q + step * c);
  return glm::normalize(q + step / 6 * (a + 2.0 * b + 2.0 * c + d));
}

/// Rotation by a rotation vector, rad.
Quat rotation_by(const Vec3& turn) {
  const double half = 0.5 * glm::length(turn);
  const double share = half > 0 ? 0.5 * std::sin(half) / half : 0.5;
  return {std::cos(half), share * turn};
}

/// A symmetric top precesses about its momentum and spins about its axis, both evenly.
Quat turned_symmetric(const BodyInertia& inertia, const Vec3& momentum, const Quat& q,
                      double duration) {
  const Quat precession = rotation_by(duration * inertia.per_across * momentum);
  const double along = glm::dot(q * inertia.axis, momentum);
  const double spin = (inertia.per_along - inertia.per_across) * along;
  return glm::normalize(precession * q * rotation_by(duration * spin * inertia.axis));
}

double largest_of(const Mat3& m) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(m[i][k]));
  }
  return largest;
}

/// Whether inertia = across + (along - across) u u^T: then its deviator d = b (u u^T - 1/3) has a
/// determinant of 2 b^3 / 27.
void find_symmetry(BodyInertia& out) {
  constexpr double kSymmetric = 1e-10;
  const double mean = (out.inertia[0][0] + out.inertia[1][1] + out.inertia[2][2]) / 3;
  const Mat3 deviator = out.inertia - mean * Mat3(1);
  const double b = std::cbrt(13.5 * glm::determinant(deviator));
  Mat3 square(0);
  if (largest_of(deviator) > kSymmetric * mean) {
    if (!(std::abs(b) > kSymmetric * mean)) return;
    square = deviator / b + Mat3(1.0 / 3);
    if (!(largest_of(square * square - square) * std::abs(b) <= kSymmetric * mean)) return;
    int most = 0;
    for (int i = 1; i < 3; ++i) {
      if (square[i][i] > square[most][most]) most = i;
    }
    out.axis = glm::normalize(square[most]);
    out.per_across = 1 / (mean - b / 3);
    out.per_along = 1 / (mean + 2 * b / 3);
  } else {
    out.per_across = out.per_along = 1 / mean;
  }
  out.symmetric = true;
}

}  // namespace

BodyInertia inertia_of(const stimuli::MassProperties& properties) {
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
  const Mat3& inverse = out.per_inertia;
  out.most_per_inertia = inverse[0][0] + inverse[1][1] + inverse[2][2];
  find_symmetry(out);
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
  if (inertia.symmetric) return turned_symmetric(inertia, spin_momentum, orientation, duration);
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
    // A momentum that decays turns the body as the initial momentum would in a shorter time.
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
