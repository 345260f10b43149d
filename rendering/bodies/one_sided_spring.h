#pragma once
// A mass against a one-sided spring for the length of a tick, in closed form: the mass meets and
// leaves the spring at the exact times within the tick, so that energy is neither gained nor lost.
// A force held constant over a tick gains energy (1 g at 1 kN/m leaves with 2.1 times its speed);
// an implicit one loses it.

namespace palpate::rendering {

/// A depth that grows freely without the spring.
struct SpringStart {
  double depth = 0;      ///< m, at the beginning; negative: spring not met yet
  double speed = 0;      ///< m/s, its growth
  double growth = 0;     ///< m/s^2, constant
  double mass = 1;       ///< kg, effective at the place of contact
  double stiffness = 1;  ///< N/m
};

/// The effect of the spring.
struct SpringPass {
  double impulse = 0;         ///< N s, integral of the force
  double double_impulse = 0;  ///< kg m, time integral of the impulse: mass moves by 1/mass of it
  double depth = 0;           ///< m, at the end
  double speed = 0;           ///< m/s, at the end
};

/// \param duration  s
SpringPass pass_spring(const SpringStart& start, double duration);

}  // namespace palpate::rendering
