#include "stimuli/parts/triangulate.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "stimuli/polygon.h"

namespace palpate::stimuli {
namespace {

// Twice the signed area of a triangle, as seen against `normal` (unit).
double turn(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  return glm::dot(glm::cross(b - a, c - b), normal);
}

// Sine of the angle that the outline turns by at b; 0 where a side has no length.
double sine_at(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  const double lengths = glm::length(b - a) * glm::length(c - b);
  return lengths > 0 ? turn(a, b, c, normal) / lengths : 0;
}

constexpr double kStraight = 1e-9;

class EarCutter {
 public:
  EarCutter(std::span<const Vec3> corners, const Vec3& normal)
      : left_(corners.begin(), corners.end()), normal_(glm::normalize(normal)) {}

  TriangleSurface run() {
    TriangleSurface triangles;
    while (left_.size() > 3) {
      const std::size_t ear = best_ear();
      if (ear == left_.size()) return {};
      triangles.push_back({at(ear, -1), left_[ear], at(ear, 1)});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  const Vec3& at(std::size_t k, int step) const {
    const auto count = static_cast<std::ptrdiff_t>(left_.size());
    return left_[static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) + step + count) % count)];
  }

  // The convex corner without others in its triangle whose smallest angle is largest; a straight
  // corner only where there is nothing better.
  std::size_t best_ear() const {
    std::size_t best = left_.size();
    double widest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < left_.size(); ++k) {
      const Vec3 &a = at(k, -1), &b = left_[k], &c = at(k, 1);
      const double sine = sine_at(a, b, c, normal_);
      if (sine < -kStraight) continue;
      const double shape = std::min({sine, sine_at(b, c, a, normal_), sine_at(c, a, b, normal_)});
      if (shape <= widest || (sine > kStraight && occupied(k))) continue;
      widest = shape;
      best = k;
    }
    return best;
  }

  bool occupied(std::size_t k) const {
    const Vec3 &a = at(k, -1), &b = left_[k], &c = at(k, 1);
    for (std::size_t i = 0; i < left_.size(); ++i) {
      const Vec3& p = left_[i];
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p, normal_) >= 0 && turn(b, c, p, normal_) >= 0 && turn(c, a, p, normal_) >= 0)
        return true;
    }
    return false;
  }

  std::vector<Vec3> left_;
  const Vec3 normal_;
};

}  // namespace

bool is_convex_polygon(std::span<const Vec3> corners, const Vec3& normal) {
  const std::size_t count = corners.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 &a = corners[k], &b = corners[(k + 1) % count], &c = corners[(k + 2) % count];
    if (sine_at(a, b, c, normal) < -kStraight) return false;
  }
  return true;
}

TriangleSurface triangulate(std::span<const Vec3> corners, const Vec3& normal) {
  if (corners.size() > 3 && glm::length(normal) > 0 &&
      !is_convex_polygon(corners, glm::normalize(normal)))
    return EarCutter(corners, normal).run();
  TriangleSurface triangles;
  for (std::size_t k = 2; k < corners.size(); ++k)
    triangles.push_back({corners[0], corners[k - 1], corners[k]});
  return triangles;
}

TriangleSurface triangulate(std::span<const Vec3> corners) {
  return triangulate(corners, plane_of(corners).normal);
}

}  // namespace palpate::stimuli
