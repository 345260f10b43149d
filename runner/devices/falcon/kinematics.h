#pragma once
// Kinematics and statics of the Falcon: encoder counts to position, force to motor torques. Lengths
// in m, angles in rad, in the Falcon's own frame: x right, y up, z out of the device towards the
// user, z = 0 at its base. Pure functions.
//
// A leg is a two-link arm in its plane (Clavel 1991; Stamper 1997). The Jacobian differs from
// libnifalcon's, which has a wrong third column (up to 66 %); tests compare ours with finite
// differences.

#include <array>
#include <optional>

#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

/// Joint angles of a leg, rad.
struct LegAngles {
  double thigh = 0;  ///< theta 1, the one with motor and encoder
  double shin = 0;   ///< theta 2, of the shin in the leg's plane
  double tilt = 0;   ///< theta 3, of the shin out of the plane
};
using Legs = std::array<LegAngles, 3>;

/// Rows are d(thigh angle of leg i) / d(position), rad/m.
using Jacobian = std::array<Vec3, 3>;

/// Encoder counts to thigh angles (rad) and back (not rounded).
Vec3 thigh_angles(const Vec3& counts);
Vec3 encoder_counts(const Vec3& thighs);

/// Inverse kinematics; nullopt: a leg cannot reach the position.
std::optional<Legs> inverse(const Vec3& position) noexcept;

Jacobian jacobian(const Legs& legs) noexcept;

struct ForwardResult {
  Vec3 position;
  int iterations = 0;
};

/// Forward kinematics: Newton's method. Steps are limited to 20 mm and halved until the residual
/// falls. From the last tick's position it takes at most 4 steps. nullopt: no convergence, or a
/// result out of the device's reach.
std::optional<ForwardResult> forward(const Vec3& thighs, const Vec3& start) noexcept;

/// Torques at the thighs, N m, that give `force` (N) on the hand; nullopt at a singularity.
std::optional<Vec3> torque_for(const Jacobian& j, const Vec3& force) noexcept;
/// The force (N) on the hand that torques (N m) give.
Vec3 force_of(const Jacobian& j, const Vec3& torque) noexcept;

/// The largest force (N) that can be rendered in every direction at a position with no torque above
/// `max_torque` (N m); 0: out of reach.
double force_in_every_direction(const Vec3& position, double max_torque) noexcept;

}  // namespace palpate::runner::devices::falcon
