#pragma once
// Faces of any number of corners as triangles.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Plane, area and diameter of a plane polygon, counter-clockwise seen from outside.
struct PolygonPlane {
  Vec3 normal;          ///< unit, outward; zero for a polygon without area
  Vec3 middle;          ///< m, mean of the corners
  double area = 0;      ///< m^2
  double diameter = 0;  ///< m, within a factor of two of the largest distance of two corners
};

/// As exact as the corners allow, also for polygons a million times longer than wide.
PolygonPlane plane_of(std::span<const Vec3> corners);

/// The results of collapse_flat_triangles.
struct Flattened {
  std::size_t triangles = 0;  ///< taken out
  std::size_t corners = 0;    ///< merged with a neighbour
  double farthest = 0;        ///< m, that a corner was moved
};

/// Takes triangles no higher than `tolerance` (m) out of a closed surface, which stays closed:
/// where the shortest side is that short its ends become one, else the neighbour over the longest
/// side is cut at the corner that lies on it. No other triangle turns over; one that could only be
/// removed that way stays. Triangles that are gone get the corners 0xffffffff; `across` holds until
/// the end.
Flattened collapse_flat_triangles(const std::vector<Vec3>& points,
                                  std::vector<std::array<std::uint32_t, 3>>& triangles,
                                  std::vector<std::array<std::uint32_t, 3>>& across,
                                  double tolerance);

/// Triangles with the numbers of the corners, turned as the face is: together they have its sides,
/// each once, and no others at their rim. The face may be concave, bent, or visit a place twice (a
/// bridge to a hole). The best-shaped ears first (Meisters 1975), as seen along its mean normal.
/// Costs corners times concave corners, up to a bound: beyond it a face that crosses itself over
/// and over is cut in the order of its corners.
std::vector<std::array<std::uint32_t, 3>> face_triangles(std::span<const Vec3> corners);

}  // namespace palpate::stimuli
