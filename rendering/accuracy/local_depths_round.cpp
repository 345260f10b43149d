#include "rendering/accuracy/local_depths_round.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <vector>

namespace palpate::rendering::depths {
namespace {

Vec3 radial(const Vec3& p) {
  const double out = std::sqrt(p.x * p.x + p.y * p.y);
  return out > 0 ? Vec3(p.x / out, p.y / out, 0) : Vec3(1, 0, 0);
}

/// Down the cone's side from the apex to the rim; not normalised.
Vec3 cone_generator(const stimuli::ObjectSpec& cone, const Vec3& out) {
  return {cone.radius * out.x, cone.radius * out.y, -cone.height};
}

/// The probe, moved out to the plane with this normal through `start`, crosses the straight line
/// start..start + line of the surface.
void cross_line(Collector& collector, const Vec3& normal, const Vec3& start, const Vec3& line) {
  const double depth = glm::dot(normal, start - collector.probe.tip);
  const Vec3 w = collector.probe.tip + depth * normal - start;  // w + fraction d = along line
  const Vec3 c = glm::cross(line, collector.d);
  const double c2 = glm::dot(c, c);
  if (c2 == 0) return;  // parallel: the ends and rims have it
  const double along = glm::dot(glm::cross(w, collector.d), c) / c2;
  if (along < 0 || along > 1) return;
  collector.add_side(normal, depth, glm::dot(glm::cross(w, line), c) / c2,
                     angle_to_line(collector.u, line));
}

/// Directions around a circle; not on the axes, where a rate may be exactly zero.
class Turns {
 public:
  static constexpr int kParts = 360;
  static double angle(int i) { return 2 * std::numbers::pi * (i + 0.123) / kParts; }
  Turns() {
    for (int i = 0; i <= kParts; ++i) all_.push_back({std::cos(angle(i)), std::sin(angle(i))});
  }
  glm::dvec2 at(int i) const { return all_[static_cast<std::size_t>(i)]; }

 private:
  std::vector<glm::dvec2> all_;
};

/// The probe's side against a rim, the circle of the shape's radius at height z: n at right angles
/// to the probe, within `belongs` (the normals that the rim has). Along the circle of those n,
/// phi' = (x - tip).n' with x the rim's point farthest along n: its roots from below, each bisected
/// to rounding, are the minima.
template <class Belongs>
void cross_rim(Collector& collector, double z, Belongs belongs) {
  static const Turns turns;
  const Vec3 across = std::abs(collector.u.z) < 0.9 ? Vec3(0, 0, 1) : Vec3(1, 0, 0);
  const Vec3 e1 = glm::normalize(glm::cross(collector.u, across)), e2 = glm::cross(collector.u, e1);
  const auto normal = [&](const glm::dvec2& turn) { return turn.x * e1 + turn.y * e2; };
  const auto touched = [&](const Vec3& n) {
    return collector.shape.radius * radial(n) + Vec3(0, 0, z);
  };
  const auto rate = [&](const glm::dvec2& turn) {  // n' is e2 cos - e1 sin
    return glm::dot(touched(normal(turn)) - collector.probe.tip, turn.x * e2 - turn.y * e1);
  };
  double last = rate(turns.at(0));
  for (int i = 0; i < Turns::kParts; ++i) {
    const double next = rate(turns.at(i + 1));
    if (last < 0 && next >= 0) {
      double low = Turns::angle(i), high = Turns::angle(i + 1);
      for (double middle = (low + high) / 2; middle > low && middle < high;
           middle = (low + high) / 2) {
        (rate({std::cos(middle), std::sin(middle)}) < 0 ? low : high) = middle;
      }
      const Vec3 n = normal({std::cos(high), std::sin(high)});
      if (belongs(n)) {
        const Vec3 x = touched(n);
        const double fraction =
            glm::dot(x - collector.probe.tip, collector.d) / (collector.length * collector.length);
        const Vec3 line = collector.shape.shape == stimuli::ShapeKind::cone
                              ? cone_generator(collector.shape, radial(n))
                              : Vec3(0, 0, 1);
        collector.add_side(
            n, glm::dot(n, x - collector.probe.tip), fraction,
            std::min(angle_to_plane(collector.u, Vec3(0, 0, 1)), angle_to_line(collector.u, line)));
      }
    }
    last = next;
  }
}

}  // namespace

Vec3 cone_normal(const stimuli::ObjectSpec& cone, const Vec3& out) {
  return glm::normalize(Vec3(cone.height * out.x, cone.height * out.y, cone.radius));
}

void depths_in_cylinder(Collector& collector) {
  const double radius = collector.shape.radius, h = collector.shape.height / 2;
  const Vec3 up(0, 0, 1);
  for (const bool tail : {false, true}) {
    const Vec3& p = tail ? collector.probe.tail : collector.probe.tip;
    if (tail && collector.is_point()) break;
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 n(0, 0, sign);
      // Out past an end: on the disc only where the end of the probe is above it.
      if (std::hypot(p.x, p.y) <= radius)
        collector.add_end(tail, n, h - sign * p.z, angle_to_plane(collector.u, n));
    }
    if (std::abs(p.z) <= h)
      collector.add_end(tail, radial(p), radius - std::hypot(p.x, p.y),
                        angle_to_line(collector.u, up));
  }
  if (collector.is_point()) return;
  const Vec3 c = glm::cross(up, collector.u);
  const double width = glm::length(c);
  for (const double sign : {-1.0, 1.0}) {
    if (width > 0) {
      const Vec3 n = sign * c / width;
      cross_line(collector, n, radius * n - h * up, 2 * h * up);
    }
    cross_rim(collector, sign * h, [&](const Vec3& n) { return n.z * sign > 0; });
  }
}

void depths_in_cone(Collector& collector) {
  const double radius = collector.shape.radius, height = collector.shape.height;
  const Vec3 apex(0, 0, height / 2), down(0, 0, -1);
  for (const bool tail : {false, true}) {
    const Vec3& p = tail ? collector.probe.tail : collector.probe.tip;
    if (tail && collector.is_point()) break;
    if (std::hypot(p.x, p.y) <= radius)
      collector.add_end(tail, down, p.z + height / 2, angle_to_plane(collector.u, down));
    const Vec3 out = radial(p), n = cone_normal(collector.shape, out),
               line = cone_generator(collector.shape, out);
    const double along = glm::dot(p - apex, line) / glm::dot(line, line);
    if (along >= 0 && along <= 1)
      collector.add_end(tail, n, glm::dot(n, apex - p), angle_to_line(collector.u, line));
  }
  if (collector.is_point()) return;
  // Normals of the side at right angles to the probe: height (u.out) + radius u.z = 0.
  const double across = std::hypot(collector.u.x, collector.u.y);
  const double cosine = across > 0 ? -radius * collector.u.z / (height * across) : 2;
  if (std::abs(cosine) <= 1) {
    const double about = std::atan2(collector.u.y, collector.u.x), turn = std::acos(cosine);
    for (const double angle : {about - turn, about + turn}) {
      const Vec3 out(std::cos(angle), std::sin(angle), 0);
      cross_line(collector, cone_normal(collector.shape, out), apex,
                 cone_generator(collector.shape, out));
    }
  }
  cross_rim(collector, -height / 2, [&](const Vec3& n) {
    return radius * std::hypot(n.x, n.y) > height * n.z;  // farther out than the apex
  });
}

}  // namespace palpate::rendering::depths
