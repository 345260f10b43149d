#pragma once
// Coordinates as a file in single precision has them.

#include "stimuli/vec.h"

namespace palpate::stimuli::checks {

/// Rounded to single precision. One number at a time through memory: GCC 12 vectorises
/// Vec3(glm::vec3(v)) at -O2 and then folds the two conversions into none.
inline Vec3 single_precision(const Vec3& place) {
  Vec3 rounded;
  for (int axis = 0; axis < 3; ++axis) {
    const volatile auto single = static_cast<float>(place[axis]);
    rounded[axis] = single;
  }
  return rounded;
}

}  // namespace palpate::stimuli::checks
