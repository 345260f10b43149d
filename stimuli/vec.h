#pragma once
// Vectors, rotations and poses. Double precision throughout; metres unless said otherwise.
// GLM leaves its vectors uninitialised unless GLM_FORCE_CTOR_INIT is defined: the build defines it.

#ifndef GLM_FORCE_CTOR_INIT
#error "build with GLM_FORCE_CTOR_INIT: uninitialised vectors must not reach a hand"
#endif

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace palpate {

using Vec3 = glm::dvec3;
using Mat3 = glm::dmat3;
using Quat = glm::dquat;  ///< Constructed as (w, x, y, z); unit when it stands for a rotation.

inline bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// A rigid placement: world = orientation * local + position.
struct Pose {
  Vec3 position{0, 0, 0};
  Quat orientation{1, 0, 0, 0};
};

}  // namespace palpate
