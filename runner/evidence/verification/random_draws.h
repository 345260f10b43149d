#pragma once
// Random draws of the searches and cases.

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "stimuli/vec.h"

namespace palpate::runner::evidence {

/// Uniform from low to high.
inline double between(Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

/// Uniform on the unit sphere.
inline Vec3 random_direction(Random& random) {
  return stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
}

}  // namespace palpate::runner::evidence
