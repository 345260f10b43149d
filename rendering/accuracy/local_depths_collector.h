#pragma once
// What the local penetration depths of all shapes share. Included by local_depths*.cpp alone.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "rendering/accuracy/local_depths.h"

namespace palpate::rendering::depths {

inline constexpr double kRightAngle = std::numbers::pi / 2;

/// rad, 0 to pi/2; both unit.
inline double angle_to_plane(const Vec3& u, const Vec3& normal) {
  return std::asin(std::min(1.0, std::abs(glm::dot(u, normal))));
}

/// rad, 0 to pi/2.
inline double angle_to_line(const Vec3& u, const Vec3& line) {
  return std::atan2(glm::length(glm::cross(u, line)), std::abs(glm::dot(u, line)));
}

/// Least first.
inline void sort_by_depth(std::vector<LocalDepth>& found) {
  std::sort(found.begin(), found.end(),
            [](const LocalDepth& a, const LocalDepth& b) { return a.depth < b.depth; });
}

/// Collects the local depths of one pose.
class Collector {
 public:
  Collector(const stimuli::ObjectSpec& object, const LineProbe& pose)
      : shape(object), probe(pose), d(pose.tail - pose.tip), length(glm::length(d)) {
    if (length > 0) u = d / length;
  }

  bool is_point() const { return length == 0; }

  /// Adds an end of the probe against a facet or smooth point with this normal, if it is the deeper
  /// end. On a tie (the probe lies flat) the tip is taken.
  void add_end(bool tail, const Vec3& normal, double depth, double flat_angle) {
    const double slope = glm::dot(normal, d);
    if (tail ? slope >= 0 : slope < 0) return;
    add(normal, depth, tail ? 1 : 0, flat_angle);
  }

  /// Adds the side of the probe, if the contact point is between its ends; normal at right angles
  /// to it.
  void add_side(const Vec3& normal, double depth, double probe_fraction, double flat_angle) {
    if (probe_fraction >= 0 && probe_fraction <= 1) add(normal, depth, probe_fraction, flat_angle);
  }

  std::vector<LocalDepth> sorted() {
    sort_by_depth(found_);
    return std::move(found_);
  }

  const stimuli::ObjectSpec& shape;
  const LineProbe& probe;
  Vec3 d, u;
  double length;

 private:
  void add(const Vec3& normal, double depth, double probe_fraction, double flat_angle) {
    found_.push_back({normal, depth, probe_fraction, is_point() ? kRightAngle : flat_angle});
  }
  std::vector<LocalDepth> found_;
};

}  // namespace palpate::rendering::depths
