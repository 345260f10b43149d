#pragma once
// Free motion of a rigid body: the state is position, velocity, orientation and angular momentum,
// so that without torque both momenta stay the same to the bit. World frame, SI units.

#include "stimuli/surfaces/mass_properties.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The constants of a body.
struct BodyInertia {
  double mass = 1;              ///< kg
  double per_mass = 1;          ///< 1/kg
  Mat3 inertia;                 ///< kg m^2, about the centre of mass, in the body's axes
  Mat3 per_inertia;             ///< its inverse
  double most_per_inertia = 1;  ///< 1/(kg m^2); its trace, a bound for every axis
  /// Two principal moments are equal to 1e-10, or all three: it turns freely in closed form.
  bool symmetric = false;
  Vec3 axis{0, 0, 1};     ///< of the third moment, if symmetric
  double per_across = 1;  ///< 1/(kg m^2); of the two equal moments
  double per_along = 1;   ///< of the third
};

/// \throws std::invalid_argument: mass or inertia is not positive
BodyInertia inertia_of(const stimuli::MassProperties& properties);

/// The motion of a body.
struct BodyMotion {
  Vec3 centre;         ///< m, of mass
  Quat orientation;    ///< from the body's axes to the world's
  Vec3 velocity;       ///< m/s, of the centre of mass
  Vec3 spin_momentum;  ///< kg m^2/s, angular momentum about the centre of mass
};

Vec3 spin_of(const BodyInertia& inertia, const BodyMotion& motion);  ///< rad/s
/// \param spin  rad/s
Vec3 spin_momentum_of(const BodyInertia& inertia, const Quat& orientation, const Vec3& spin);
Mat3 world_per_inertia(const BodyInertia& inertia, const Quat& orientation);
/// J, of translation and rotation.
double kinetic_energy(const BodyInertia& inertia, const BodyMotion& motion);

/// m/s; of a point that moves with the body.
Vec3 velocity_at(const Vec3& spin, const BodyMotion& motion, const Vec3& point);

/// Turns by a rotation vector.
/// \param turn  rad, world frame
Quat turned(const Quat& orientation, const Vec3& turn);

/// Moves a body for a time in which only gravity and damping act. Gravity and linear damping are in
/// closed form. So is orientation if two moments of inertia are equal; otherwise classical
/// Runge-Kutta 4 with constant angular momentum, in steps of at most 0.02 rad: the error of
/// orientation is of fourth order, that of momentum zero.
/// \param damping  1/s, of velocity and spin. \param duration  s
void move_freely(const BodyInertia& inertia, const Vec3& gravity, double damping, double duration,
                 BodyMotion& motion);

/// The orientation alone.
Quat turned_freely(const BodyInertia& inertia, const Vec3& spin_momentum, Quat orientation,
                   double duration);

}  // namespace palpate::rendering
