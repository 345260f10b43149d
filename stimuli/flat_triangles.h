#pragma once
// Triangles without area in a closed surface.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Takes triangles no higher than `tolerance` (m) out of a closed surface, which stays closed:
/// where the shortest side is that short its ends become one, else the neighbour over the longest
/// side is cut at the corner that lies on it. No other triangle turns over; what can only be done
/// so is left. Triangles that are gone get the corners 0xffffffff; `across` holds until the end.
/// \return how many were taken out
std::size_t collapse_flat_triangles(const std::vector<Vec3>& points,
                                    std::vector<std::array<std::uint32_t, 3>>& triangles,
                                    std::vector<std::array<std::uint32_t, 3>>& across,
                                    double tolerance);

}  // namespace palpate::stimuli
