#include "runner/evidence/accuracy/local_depths.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace depths {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

/// rad, 0 to pi/2; both unit.
double angle_to_plane(const Vec3& u, const Vec3& normal) {
  return std::asin(std::min(1.0, std::abs(glm::dot(u, normal))));
}

/// rad, 0 to pi/2.
double angle_to_line(const Vec3& u, const Vec3& line) {
  return std::atan2(glm::length(glm::cross(u, line)), std::abs(glm::dot(u, line)));
}

/// Least first.
void sort_by_depth(std::vector<LocalDepth>& found) {
  std::sort(found.begin(), found.end(),
            [](const LocalDepth& a, const LocalDepth& b) { return a.depth < b.depth; });
}

/// Collects the local depths of one pose.
class Collector {
 public:
  Collector(const stimuli::ObjectSpec& object, const rendering::LineProbe& pose)
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
  const rendering::LineProbe& probe;
  Vec3 d, u;
  double length;

 private:
  void add(const Vec3& normal, double depth, double probe_fraction, double flat_angle) {
    found_.push_back({normal, depth, probe_fraction, is_point() ? kRightAngle : flat_angle});
  }
  std::vector<LocalDepth> found_;
};

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
  if (c2 == 0) return;  // parallel: the ends and rims cover this case
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

/// Outward normal of the cone's side in the half plane of the horizontal unit vector `out`.
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
      // Beyond an end of the cylinder: on its disc only if the end of the probe is above the disc.
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
  // For a probe through the centre, take any direction across it.
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
      // The edges along this axis; the normal selects one.
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
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("local_depths: a mesh or compound is no analytic primitive");
}

/// Whether some point of the probe is within the shape: minimises a convex function by ternary
/// search.
bool overlaps(const stimuli::ObjectSpec& shape, const rendering::LineProbe& probe) {
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

std::vector<LocalDepth> local_depths(const stimuli::ConvexMesh& mesh,
                                     const rendering::LineProbe& probe, const Vec3& towards,
                                     double angle) {
  const double least_cosine = angle < std::numbers::pi ? std::cos(angle) : -2;
  const double slack = 1e-12 * mesh.size();
  const Vec3 d = probe.tail - probe.tip;
  const double length = glm::length(d);
  const Vec3 u = length > 0 ? d / length : Vec3();
  const auto flatness = [&](const stimuli::Facet& facet) {
    return length > 0 ? depths::angle_to_plane(u, facet.normal) : depths::kRightAngle;
  };
  std::vector<LocalDepth> found;
  for (const stimuli::Facet& facet : mesh.facets()) {
    if (glm::dot(facet.normal, towards) < least_cosine) continue;
    const bool tail = glm::dot(facet.normal, d) < 0;
    const Vec3& end = tail ? probe.tail : probe.tip;
    const double depth = facet.offset - glm::dot(facet.normal, end);
    if (depth < 0) return {};  // a plane separates them
    const Vec3 foot = end + depth * facet.normal;
    bool over = true;
    for (std::uint32_t i = 0; over && i < facet.side_count; ++i) {
      const stimuli::Side& side = mesh.sides()[facet.first_side + i];
      over = glm::dot(side.inward, foot) >= side.offset - slack;
    }
    if (over) found.push_back({facet.normal, depth, tail ? 1.0 : 0.0, flatness(facet)});
  }
  for (const stimuli::Edge& edge : mesh.edges()) {
    const stimuli::Facet &left = mesh.facets()[edge.left], &right = mesh.facets()[edge.right];
    const double left_slope = glm::dot(left.normal, d), right_slope = glm::dot(right.normal, d);
    if ((left_slope >= 0) == (right_slope >= 0)) continue;
    // At right angles to the probe, between the normals of the edge's two faces.
    const Vec3 n =
        glm::normalize(std::abs(right_slope) * left.normal + std::abs(left_slope) * right.normal);
    if (glm::dot(n, towards) < least_cosine) continue;
    const Vec3& v0 = edge.from;
    const Vec3 line = edge.to - v0;
    const Vec3 c = glm::cross(line, d);
    const double c2 = glm::dot(c, c);
    if (c2 <= 1e-18 * glm::dot(line, line) * length * length) continue;  // no width
    const double depth = glm::dot(n, v0 - probe.tip);
    if (depth < 0) return {};
    const Vec3 w = probe.tip + depth * n - v0;
    const double along = glm::dot(glm::cross(w, d), c) / c2;
    const double fraction = glm::dot(glm::cross(w, line), c) / c2;
    const double beyond_edge = slack / glm::length(line), beyond_end = slack / length;
    if (along < -beyond_edge || along > 1 + beyond_edge) continue;
    if (fraction < -beyond_end || fraction > 1 + beyond_end) continue;
    found.push_back(
        {n, depth, std::clamp(fraction, 0.0, 1.0), std::min(flatness(left), flatness(right))});
  }
  depths::sort_by_depth(found);
  return found;
}

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
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("support: a mesh or compound is no analytic primitive");
}

double depth_along(const stimuli::ObjectSpec& primitive, const rendering::LineProbe& probe,
                   const Vec3& n) {
  return support(primitive, n) - std::min(glm::dot(n, probe.tip), glm::dot(n, probe.tail));
}

std::vector<LocalDepth> local_depths(const stimuli::ObjectSpec& primitive,
                                     const rendering::LineProbe& probe) {
  support(primitive, Vec3());  // refuses all but primitives
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
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;  // refused above
  }
  return collector.sorted();
}

}  // namespace palpate::runner::evidence
