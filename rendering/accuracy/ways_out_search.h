#pragma once
// Internal to the ways out: what the searches of all shapes share.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "rendering/accuracy/ways_out.h"

namespace palpate::rendering::ways {

inline constexpr double kRight = std::numbers::pi / 2;

/// rad, 0 to pi/2; both unit.
inline double angle_to_plane(const Vec3& u, const Vec3& normal) {
  return std::asin(std::min(1.0, std::abs(glm::dot(u, normal))));
}

/// rad, 0 to pi/2.
inline double angle_to_line(const Vec3& u, const Vec3& line) {
  return std::atan2(glm::length(glm::cross(u, line)), std::abs(glm::dot(u, line)));
}

/// Least first.
inline void sort_by_depth(std::vector<WayOut>& found) {
  std::sort(found.begin(), found.end(),
            [](const WayOut& a, const WayOut& b) { return a.depth < b.depth; });
}

/// Collects the ways out of one pose.
class Search {
 public:
  Search(const stimuli::ObjectSpec& object, const LineProbe& pose)
      : shape(object), probe(pose), d(pose.tail - pose.tip), length(glm::length(d)) {
    if (length > 0) u = d / length;
  }

  bool is_point() const { return length == 0; }

  /// An end of the probe against a smooth place or a face with this normal; it must be the deeper
  /// end. On a tie (the probe lies flat) the tip is taken.
  void end(bool tail, const Vec3& normal, double depth, double flat_angle) {
    const double rise = glm::dot(normal, d);
    if (tail ? rise >= 0 : rise < 0) return;
    add(normal, depth, tail ? 1 : 0, flat_angle);
  }

  /// The side of the probe; normal at right angles to it.
  void side(const Vec3& normal, double depth, double place, double flat_angle) {
    if (place >= 0 && place <= 1) add(normal, depth, place, flat_angle);
  }

  std::vector<WayOut> sorted() {
    sort_by_depth(found_);
    return std::move(found_);
  }

  const stimuli::ObjectSpec& shape;
  const LineProbe& probe;
  Vec3 d, u;
  double length;

 private:
  void add(const Vec3& normal, double depth, double place, double flat_angle) {
    found_.push_back({normal, depth, place, is_point() ? kRight : flat_angle});
  }
  std::vector<WayOut> found_;
};

}  // namespace palpate::rendering::ways
