#pragma once
// Random numbers as the searches and cases draw them.

#include "stimuli/orientation.h"
#include "stimuli/random.h"

namespace palpate::rendering {

/// Uniform from low to high.
inline double between(stimuli::Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

/// Uniform on the unit sphere.
inline Vec3 random_direction(stimuli::Random& random) {
  return stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
}

}  // namespace palpate::rendering
