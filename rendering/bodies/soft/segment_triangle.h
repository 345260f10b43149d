#pragma once
// Nearest points of segments and triangles. Pure functions; m.

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/vec.h"

namespace palpate::rendering {

struct Segment {
  Vec3 from, along;  ///< to its other end; zero: a point
};

struct NearestOnSegments {
  double own = 0, other = 0;  ///< 0 to 1, on each
};

/// Where two segments are nearest to each other; for parallel ones, the middle of their common
/// length. Ericson 2005, "Real-time collision detection", 5.1.9.
inline NearestOnSegments nearest_on_segments(const Segment& own, const Segment& other) {
  const Vec3 r = own.from - other.from;
  const double a = glm::dot(own.along, own.along), e = glm::dot(other.along, other.along);
  const double f = glm::dot(other.along, r);
  const auto part = [](double x) { return std::clamp(x, 0.0, 1.0); };
  if (!(a > 0)) return {0, e > 0 ? part(f / e) : 0};
  const double c = glm::dot(own.along, r);
  if (!(e > 0)) return {part(-c / a), 0};
  const double b = glm::dot(own.along, other.along), det = a * e - b * b;
  double s = 0;
  if (det > 1e-12 * a * e) {
    s = part((b * f - c * e) / det);
  } else {
    const double first = -c / a, last = (b - c) / a;  // the other's ends on this one
    const double low = part(std::min(first, last)), high = part(std::max(first, last));
    s = 0.5 * (low + high);
  }
  double t = (b * s + f) / e;
  if (t < 0) {
    t = 0;
    s = part(-c / a);
  } else if (t > 1) {
    t = 1;
    s = part((b - c) / a);
  }
  return {s, t};
}

/// Weights of the corners for the foot of p's perpendicular; false: the foot is outside the
/// triangle.
inline bool foot_in_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c,
                             std::array<double, 3>& weights) {
  const Vec3 u = b - a, v = c - a, w = p - a, n = glm::cross(u, v);
  const double nn = glm::dot(n, n);
  if (!(nn > 0)) return false;
  const double beta = glm::dot(glm::cross(w, v), n) / nn;
  const double gamma = glm::dot(glm::cross(u, w), n) / nn;
  weights = {1 - beta - gamma, beta, gamma};
  return weights[0] > 0 && beta > 0 && gamma > 0;
}

/// Whether the segment crosses the triangle; touching counts.
inline bool crosses(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = glm::cross(b - a, c - a);
  const double before = glm::dot(s.from - a, n), after = before + glm::dot(s.along, n);
  if ((before > 0) == (after > 0)) return false;
  const Vec3 at = s.from + before / (before - after) * s.along;
  std::array<double, 3> weights{};
  return foot_in_triangle(at, a, b, c, weights);
}

inline double distance_to_triangle(const Segment& s, const Vec3& a, const Vec3& b, const Vec3& c) {
  if (crosses(s, a, b, c)) return 0;
  double least = INFINITY;
  const auto edge = [&](const Vec3& from, const Vec3& to) {
    const NearestOnSegments at = nearest_on_segments(s, {from, to - from});
    least =
        std::min(least, glm::distance(s.from + at.own * s.along, from + at.other * (to - from)));
  };
  edge(a, b);
  edge(b, c);
  edge(c, a);
  for (const double along : {0.0, 1.0}) {
    const Vec3 p = s.from + along * s.along;
    std::array<double, 3> w{};
    if (foot_in_triangle(p, a, b, c, w))
      least = std::min(least, glm::distance(p, w[0] * a + w[1] * b + w[2] * c));
  }
  return least;
}

/// Signed; positive if p sees the triangle from behind (its normal points away). Van Oosterom &
/// Strackee 1983, "The solid angle of a plane triangle".
inline double solid_angle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = a - p, v = b - p, w = c - p;
  const double x = glm::length(u), y = glm::length(v), z = glm::length(w);
  return 2 * std::atan2(glm::dot(u, glm::cross(v, w)),
                        x * y * z + glm::dot(u, v) * z + glm::dot(v, w) * x + glm::dot(w, u) * y);
}

}  // namespace palpate::rendering
