#pragma once
// The point nearest to a given one among those above some planes, by trying every vertex, edge and
// face that they can form. For checks, not for the servo.

#include <optional>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::rendering {

/// The points x with dot(normal, x) >= offset.
struct HalfSpace {
  Vec3 normal;  ///< unit
  double offset = 0;
};

struct NearestPoint {
  Vec3 point;
  /// m, one for each plane: point = from + sum of multiplier * normal; none is negative
  std::vector<double> multipliers;
};

/// \param tolerance  how far below a plane is still above it
/// \return empty when no point is above all of them, or none can be told from rounding
std::optional<NearestPoint> nearest_point(const Vec3& from, std::span<const HalfSpace> planes,
                                          double tolerance);

/// m; how far a vector is from all sums of non-negative multiples of the normals. In 3 dimensions
/// the nearest of them has at most three terms, which are all tried.
/// \param normals        unit
/// \param most_multiple  of a normal, in lengths of the vector: beyond 1e5 opposite normals hold
///                       anything across them
double distance_to_cone(const Vec3& vector, std::span<const Vec3> normals,
                        double most_multiple = 1e5);

}  // namespace palpate::rendering
