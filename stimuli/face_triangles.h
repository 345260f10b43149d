#pragma once
// A face of any number of corners as triangles.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Triangles with the numbers of the corners, turned as the face is: together they have its sides,
/// each once, and no others at their rim. The face may be concave, bent, or visit a place twice (a
/// bridge to a hole). The best-shaped ears first (Meisters 1975), as seen along its mean normal.
/// Costs corners times concave corners.
std::vector<std::array<std::uint32_t, 3>> face_triangles(std::span<const Vec3> corners);

}  // namespace palpate::stimuli
