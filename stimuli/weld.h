#pragma once
// Merging of points that coincide.

#include <cstdint>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// For each point the number of the first point at the same place.
std::vector<std::uint32_t> weld_equal(const std::vector<Vec3>& points);

/// For each point the number of the point that it is welded to (itself, for the first of its
/// cluster). Points at most `tolerance` (m) apart are one; all coordinates must be finite.
std::vector<std::uint32_t> weld(const std::vector<Vec3>& points, double tolerance);

}  // namespace palpate::stimuli
