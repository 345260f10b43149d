#pragma once
// Whether a tool lies in a solid, by definition: a place is inside if the surface winds round it a
// positive number of times. Looks at all triangles for every answer and shares no code with
// rendering/.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "stimuli/closed_surface.h"

namespace palpate::testing {

/// From `from` to from + along, m; along zero: a point.
struct Segment {
  Vec3 from, along;
};

class WindingOracle {
 public:
  explicit WindingOracle(const stimuli::ClosedSurface& surface) {
    for (const auto& corners : surface.triangles) {
      Triangle t;
      for (std::size_t k = 0; k < 3; ++k) t.corners[k] = kTurn * surface.vertices[corners[k]];
      const auto& [a, b, c] = t.corners;
      const Vec3 across = glm::cross(b - a, c - a);
      if (glm::length(across) > 0) t.normal = glm::normalize(across);
      t.low = glm::min(a, glm::min(b, c));
      t.high = glm::max(a, glm::max(b, c));
      low_ = glm::min(low_, t.low);
      high_ = glm::max(high_, t.high);
      triangles_.push_back(t);
    }
  }

  double size() const { return glm::distance(low_, high_); }  ///< m

  int winding(const Vec3& place) const { return turned_winding(kTurn * place); }

  /// Whether some place of the segment is inside and all that is outside is farther from that place
  /// than `depth` (m).
  bool holds(const Segment& segment, double depth) const {
    const Vec3 from = kTurn * segment.from, along = kTurn * segment.along;
    if (is_deep(from, depth)) return true;
    if (along == Vec3(0)) return false;
    // The winding number is the same between two crossings.
    const std::vector<double> crossings = crossings_of(from, along);
    const double rounding = kRounding * size() / glm::length(along);
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
      const double first = crossings[i], room = crossings[i + 1] - first;
      if (room <= rounding || turned_winding(from + (first + 0.5 * room) * along) <= 0) continue;
      for (const double share : {0.5, 0.25, 0.75}) {
        if (is_deep(from + (first + share * room) * along, depth)) return true;
      }
    }
    return is_deep(from + along, depth);
  }

 private:
  struct Triangle {
    std::array<Vec3, 3> corners;
    Vec3 normal;     ///< unit, outward; zero without area
    Vec3 low, high;  ///< of its box
  };
  static constexpr double kRounding = 1e-11, kNearly = 1e-6;  // of the size
  // Rays go up in a frame that is turned by an odd angle, so that no wall of a drawing is upright.
  inline static const Quat kTurn = glm::normalize(Quat(0.83, 0.31, -0.27, 0.38));

  /// Whether an edge, seen from above, passes the point on its left (1) or right (-1), as a ray in
  /// the direction of +x meets it. The same edge the other way gives exactly the opposite, and of
  /// two edges at a corner one counts: no tie counts twice or not at all.
  static int passes(const Vec3& a, const Vec3& b, const Vec3& p) {
    if ((a.y <= p.y) == (b.y <= p.y)) return 0;
    const double side = (a.x - p.x) * (b.y - p.y) - (b.x - p.x) * (a.y - p.y);
    return a.y <= p.y ? (side > 0 ? 1 : 0) : (side < 0 ? -1 : 0);
  }

  /// Counts the triangles above the point: up if they are seen from inside, down if from outside.
  int turned_winding(const Vec3& p) const {
    int sum = 0;
    for (const Triangle& t : triangles_) {
      if (p.x < t.low.x || p.x > t.high.x || p.y < t.low.y || p.y > t.high.y || p.z > t.high.z)
        continue;
      const auto& [a, b, c] = t.corners;
      const int turn = passes(a, b, p) + passes(b, c, p) + passes(c, a, p);
      if (turn == 0) continue;
      const double height = glm::dot(glm::cross(b - a, c - a), p - a);
      if (p.z < t.low.z || height * turn < 0) sum += turn;
    }
    return sum;
  }

  static double distance(const Triangle& t, const Vec3& p) {
    bool over = glm::length(t.normal) > 0;
    double to_sides = HUGE_VAL;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = t.corners[k], side = t.corners[(k + 1) % 3] - a;
      over &= glm::dot(glm::cross(t.normal, side), p - a) >= 0;
      const double length2 = glm::dot(side, side);
      const double share = length2 > 0 ? glm::dot(side, p - a) / length2 : 0;
      to_sides = std::min(to_sides, glm::distance(p, a + std::clamp(share, 0.0, 1.0) * side));
    }
    return over ? std::abs(glm::dot(t.normal, p - t.corners[0])) : to_sides;
  }

  /// Shares of the segment, in order, with both its ends. Those of the planes of triangles beside
  /// the segment do no harm.
  std::vector<double> crossings_of(const Vec3& from, const Vec3& along) const {
    std::vector<double> shares = {0, 1};
    const Vec3 low = glm::min(from, from + along), high = glm::max(from, from + along);
    const double near = kNearly * size();
    for (const Triangle& t : triangles_) {
      if (t.low.x > high.x || t.low.y > high.y || t.low.z > high.z || t.high.x < low.x ||
          t.high.y < low.y || t.high.z < low.z)
        continue;
      const double first = glm::dot(t.normal, from - t.corners[0]),
                   last = first + glm::dot(t.normal, along);
      if ((first <= 0) == (last <= 0)) continue;
      const double share = first / (first - last);
      if (distance(t, from + share * along) <= near) shares.push_back(share);
    }
    std::sort(shares.begin(), shares.end());
    return shares;
  }

  /// Whether the point is inside and nothing within `depth` of it is outside.
  bool is_deep(const Vec3& p, double depth) const {
    if (turned_winding(p) <= 0) return false;
    std::vector<Vec3> normals;  // of the triangles so near
    Vec3 sum(0);
    for (const Triangle& t : triangles_) {
      if (glm::any(glm::lessThan(p, t.low - depth)) ||
          glm::any(glm::greaterThan(p, t.high + depth)) || distance(t, p) > depth)
        continue;
      normals.push_back(t.normal);
      sum += t.normal;
    }
    // Without a triangle so near, it is deep. Shells that overlap have triangles in the solid too,
    // so a step away from them must end outside.
    const auto ends_outside = [&](const Vec3& way) {
      const double length = glm::length(way);
      return length > 0 && turned_winding(p + depth / length * way) <= 0;
    };
    if (ends_outside(sum)) return false;
    for (const Vec3& a : normals) {
      for (const Vec3& b : normals) {
        if (ends_outside(a + b)) return false;
        for (const Vec3& c : normals) {
          // As far from each of the three planes: out of a corner, however narrow.
          const Vec3 way = glm::cross(a, b) + glm::cross(b, c) + glm::cross(c, a);
          if (ends_outside(way) || ends_outside(-way)) return false;
        }
      }
    }
    return true;
  }

  std::vector<Triangle> triangles_;
  Vec3 low_{HUGE_VAL}, high_{-HUGE_VAL};
};

}  // namespace palpate::testing
