// Local penetration depths in the analytic shapes; sphere, cube and box.

#include "rendering/accuracy/local_depths.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "rendering/accuracy/local_depths_collector.h"
#include "rendering/accuracy/local_depths_round.h"

namespace palpate::rendering {
namespace depths {
namespace {

void depths_in_sphere(Collector& collector) {
  const double radius = collector.shape.radius;
  const auto add_end = [&](bool tail) {
    const Vec3& p = tail ? collector.probe.tail : collector.probe.tip;
    const double from = glm::length(p);
    collector.add_end(tail, from > 0 ? p / from : Vec3(0, 0, 1), radius - from, kRightAngle);
  };
  add_end(false);
  if (collector.is_point()) return;
  add_end(true);
  const double fraction =
      -glm::dot(collector.probe.tip, collector.d) / (collector.length * collector.length);
  const Vec3 foot = collector.probe.tip + fraction * collector.d;
  const double from = glm::length(foot);
  // A probe through the centre: any direction across it.
  const Vec3 normal = from > 1e-12 * radius ? foot / from
                      : std::abs(collector.u.z) < 0.9
                          ? glm::normalize(glm::cross(collector.u, Vec3(0, 0, 1)))
                          : glm::normalize(glm::cross(collector.u, Vec3(1, 0, 0)));
  collector.add_side(normal, radius - from, fraction, kRightAngle);
}

/// Half the edges of a cube or a box, m.
Vec3 half_of(const stimuli::ObjectSpec& s) {
  return s.shape == stimuli::ShapeKind::cube ? Vec3(s.edge / 2) : 0.5 * s.size;
}

void depths_in_box(Collector& collector) {
  const Vec3 h = half_of(collector.shape);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 normal;
      normal[axis] = sign;
      const double flat = angle_to_plane(collector.u, normal);
      for (const bool tail : {false, true}) {
        const Vec3& p = tail ? collector.probe.tail : collector.probe.tip;
        const int beside = (axis + 1) % 3, before = (axis + 2) % 3;
        if (std::abs(p[beside]) <= h[beside] && std::abs(p[before]) <= h[before])
          collector.add_end(tail, normal, h[axis] - sign * p[axis], flat);
      }
      if (collector.is_point()) continue;
      // The edges along this axis: the normal chooses which.
      Vec3 line;
      line[axis] = 1;
      const Vec3 c = sign * glm::cross(line, collector.u);
      const double width = glm::length(c);
      if (width == 0) continue;
      const Vec3 n = c / width;
      const int i = (axis + 1) % 3, k = (axis + 2) % 3;
      if (n[i] == 0 || n[k] == 0) continue;  // flat on a face
      Vec3 start;
      start[axis] = -h[axis];
      start[i] = std::copysign(h[i], n[i]);
      start[k] = std::copysign(h[k], n[k]);
      const double before = collector.u[i], beside = collector.u[k];
      const double depth = glm::dot(n, start - collector.probe.tip);
      const Vec3 w = collector.probe.tip + depth * n - start;
      const Vec3 edge = 2 * h[axis] * line;
      const Vec3 across = glm::cross(edge, collector.d);
      const double c2 = glm::dot(across, across);
      const double along = glm::dot(glm::cross(w, collector.d), across) / c2;
      if (along < 0 || along > 1) continue;
      collector.add_side(n, depth, glm::dot(glm::cross(w, edge), across) / c2,
                         std::asin(std::min({1.0, std::abs(before), std::abs(beside)})));
    }
  }
}

/// At most 0 inside the shape, above 0 outside; convex. Not a distance past rims and edges.
double outside_by(const stimuli::ObjectSpec& s, const Vec3& p) {
  const double out = std::hypot(p.x, p.y);
  switch (s.shape) {
    case stimuli::ShapeKind::sphere:
      return glm::length(p) - s.radius;
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box: {
      const Vec3 out_of = glm::abs(p) - half_of(s);
      return std::max({out_of.x, out_of.y, out_of.z});
    }
    case stimuli::ShapeKind::cylinder:
      return std::max(out - s.radius, std::abs(p.z) - s.height / 2);
    case stimuli::ShapeKind::cone: {
      const Vec3 side = cone_normal(s, Vec3(1, 0, 0));
      return std::max(side.x * out + side.z * (p.z - s.height / 2), -p.z - s.height / 2);
    }
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("local_depths: a mesh or compound is no analytic primitive");
}

/// Some point of the probe is within the shape: the least of a convex function by thirds.
bool overlaps(const stimuli::ObjectSpec& shape, const LineProbe& probe) {
  const auto at = [&](double t) {
    return outside_by(shape, probe.tip + t * (probe.tail - probe.tip));
  };
  double low = 0, high = 1;
  for (int i = 0; i < 100 && at(low) > 0 && at(high) > 0; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (at(a) <= at(b) ? high : low) = at(a) <= at(b) ? b : a;
  }
  return at(low) <= 0 || at(high) <= 0;
}

}  // namespace
}  // namespace depths

double support(const stimuli::ObjectSpec& primitive, const Vec3& n) {
  const double out = primitive.radius * std::hypot(n.x, n.y), up = primitive.height / 2 * n.z;
  switch (primitive.shape) {
    case stimuli::ShapeKind::sphere:
      return primitive.radius * glm::length(n);
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box:
      return glm::dot(depths::half_of(primitive), glm::abs(n));
    case stimuli::ShapeKind::cylinder:
      return out + std::abs(up);
    case stimuli::ShapeKind::cone:
      return std::max(up, out - up);
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("support: a mesh or compound is no analytic primitive");
}

double depth_along(const stimuli::ObjectSpec& primitive, const LineProbe& probe, const Vec3& n) {
  return support(primitive, n) - std::min(glm::dot(n, probe.tip), glm::dot(n, probe.tail));
}

std::vector<LocalDepth> local_depths(const stimuli::ObjectSpec& primitive, const LineProbe& probe) {
  support(primitive, Vec3());  // refuses what is no primitive
  if (!depths::overlaps(primitive, probe)) return {};
  depths::Collector collector(primitive, probe);
  switch (primitive.shape) {
    case stimuli::ShapeKind::sphere:
      depths::depths_in_sphere(collector);
      break;
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box:
      depths::depths_in_box(collector);
      break;
    case stimuli::ShapeKind::cylinder:
      depths::depths_in_cylinder(collector);
      break;
    case stimuli::ShapeKind::cone:
      depths::depths_in_cone(collector);
      break;
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;  // refused above
  }
  return collector.sorted();
}

}  // namespace palpate::rendering
