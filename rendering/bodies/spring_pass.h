#pragma once
// A mass against a one-sided spring for the length of a tick, in closed form: the spring is entered
// and left at their times within the tick, so that energy is neither made nor lost. A force that is
// held over a tick makes energy (1 g at 1 kN/m leaves with 2.1 times its speed), an implicit one
// loses it.

namespace palpate::rendering {

/// A depth that would grow freely.
struct SpringStart {
  double depth = 0;      ///< m, at the beginning; negative before the spring is met
  double speed = 0;      ///< m/s, by which it grows
  double growth = 0;     ///< m/s^2, constant
  double mass = 1;       ///< kg, effective at the place of contact
  double stiffness = 1;  ///< N/m
};

/// What the spring did.
struct SpringPass {
  double impulse = 0;         ///< N s, integral of the force
  double double_impulse = 0;  ///< kg m, integral of the impulse so far: moves mass by 1/mass of it
  double depth = 0;           ///< m, at the end
  double speed = 0;           ///< m/s, at the end
};

/// \param duration  s
SpringPass pass_spring(const SpringStart& start, double duration);

}  // namespace palpate::rendering
