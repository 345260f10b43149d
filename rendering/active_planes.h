#pragma once
// The nearest point that several half-spaces allow: where an ideal tool rests on up to three planes
// at once, and what share of the way each of them holds. Any frame, m.

#include <array>
#include <cstddef>
#include <span>

#include "stimuli/vec.h"

namespace palpate::rendering {

/// What the points with dot(normal, p) >= bound belong to.
struct PlaneBound {
  Vec3 normal;       ///< unit, out of the obstacle
  double bound = 0;  ///< m
};

/// More planes than these never hold the ideal tool at once; three do in the end.
inline constexpr std::size_t kMostPlanes = 8;

/// The point nearest to the origin, as the sum of multiplier * normal over the half-spaces, with
/// multipliers >= 0 of which at most three are positive.
struct ConstrainedPoint {
  Vec3 point;
  std::array<double, kMostPlanes> multipliers{};  ///< m
  bool found = false;                             ///< the half-spaces have points in common
};

/// In closed form: a face, then an edge, then a vertex of the intersection is tried, so that of
/// planes that agree within the tolerance the fewest carry.
/// \param half_spaces  up to kMostPlanes
/// \param tolerance    m; a half-space that is violated by no more than this is satisfied
ConstrainedPoint constrained_point(std::span<const PlaneBound> half_spaces, double tolerance);

}  // namespace palpate::rendering
