#pragma once
// Random rotations.

#include "data/base/random.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Uniformly distributed rotation: Marsaglia (1972), "Choosing a point from the surface of a
/// sphere", by rejection; needs only + x / and sqrt, so it is the same on every compiler.
/// Returned as a unit quaternion with w >= 0.
Quat uniform_rotation(Random& random);

}  // namespace palpate::stimuli
