#pragma once

#include <array>

#include "stimuli/vec.h"

namespace palpate::stimuli {

using CornerTriangle = std::array<Vec3, 3>;  ///< counter-clockwise seen from outside, m

/// The point of a triangle that is nearest to another point.
Vec3 nearest_on_triangle(const CornerTriangle& triangle, const Vec3& from);

}  // namespace palpate::stimuli
