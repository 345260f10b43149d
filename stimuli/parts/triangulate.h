#pragma once
// Triangles of a plane polygon that need not be convex.

#include <span>

#include "stimuli/parts/solid.h"

namespace palpate::stimuli {

/// Whether a simple plane polygon has no reflex corner (beyond rounding).
bool is_convex_polygon(std::span<const Vec3> corners, const Vec3& normal);

/// Cuts off ears (Meisters 1975), the best-shaped first. Counter-clockwise about `normal` (of any
/// length), as the corners are. Empty where the polygon crosses itself. Costs corners^3 at worst,
/// corners where it is convex.
TriangleSurface triangulate(std::span<const Vec3> corners, const Vec3& normal);

/// The same, about the polygon's own normal.
TriangleSurface triangulate(std::span<const Vec3> corners);

}  // namespace palpate::stimuli
