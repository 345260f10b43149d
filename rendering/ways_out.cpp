#include "rendering/ways_out.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <stdexcept>

namespace palpate {
namespace {

constexpr double kRight = std::numbers::pi / 2;

double angle_to_plane(const Vec3& u, const Vec3& normal) {
  return std::asin(std::min(1.0, std::abs(glm::dot(u, normal))));
}

double angle_to_line(const Vec3& u, const Vec3& line) {
  return std::atan2(glm::length(glm::cross(u, line)), std::abs(glm::dot(u, line)));
}

/// Collects the ways out of one pose.
class Search {
 public:
  Search(const ObjectSpec& object, const LineProbe& pose)
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
    std::sort(found_.begin(), found_.end(),
              [](const WayOut& a, const WayOut& b) { return a.depth < b.depth; });
    return std::move(found_);
  }

  const ObjectSpec& shape;
  const LineProbe& probe;
  Vec3 d, u;
  double length;

 private:
  void add(const Vec3& normal, double depth, double place, double flat_angle) {
    found_.push_back({normal, depth, place, is_point() ? kRight : flat_angle});
  }
  std::vector<WayOut> found_;
};

Vec3 radial(const Vec3& p) {
  const double out = std::sqrt(p.x * p.x + p.y * p.y);
  return out > 0 ? Vec3(p.x / out, p.y / out, 0) : Vec3(1, 0, 0);
}

/// Outward normal of the cone's side in the half plane of the horizontal unit vector `out`.
Vec3 cone_normal(const ObjectSpec& cone, const Vec3& out) {
  return glm::normalize(Vec3(cone.height * out.x, cone.height * out.y, cone.radius));
}

/// Down the cone's side from the apex to the rim; not normalised.
Vec3 cone_generator(const ObjectSpec& cone, const Vec3& out) {
  return {cone.radius * out.x, cone.radius * out.y, -cone.height};
}

/// The probe, moved out to the plane with this normal through `start`, crosses the straight line
/// start..start + line of the surface.
void cross_line(Search& s, const Vec3& normal, const Vec3& start, const Vec3& line) {
  const double depth = glm::dot(normal, start - s.probe.tip);
  const Vec3 w = s.probe.tip + depth * normal - start;  // w + place d = along line
  const Vec3 c = glm::cross(line, s.d);
  const double c2 = glm::dot(c, c);
  if (c2 == 0) return;  // parallel: the ends and rims have it
  const double along = glm::dot(glm::cross(w, s.d), c) / c2;
  if (along < 0 || along > 1) return;
  s.side(normal, depth, glm::dot(glm::cross(w, line), c) / c2, angle_to_line(s.u, line));
}

/// Directions around a circle, off the axes, where a rate may be exactly zero.
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
/// phi' = (x - tip).n' with x the rim's point farthest along n: its roots from below, each halved
/// down to rounding, are the minima.
template <class Belongs>
void cross_rim(Search& s, double z, Belongs belongs) {
  static const Turns turns;
  const Vec3 across = std::abs(s.u.z) < 0.9 ? Vec3(0, 0, 1) : Vec3(1, 0, 0);
  const Vec3 e1 = glm::normalize(glm::cross(s.u, across)), e2 = glm::cross(s.u, e1);
  const auto normal = [&](const glm::dvec2& turn) { return turn.x * e1 + turn.y * e2; };
  const auto touched = [&](const Vec3& n) { return s.shape.radius * radial(n) + Vec3(0, 0, z); };
  const auto rate = [&](const glm::dvec2& turn) {  // n' is e2 cos - e1 sin
    return glm::dot(touched(normal(turn)) - s.probe.tip, turn.x * e2 - turn.y * e1);
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
        const double place = glm::dot(x - s.probe.tip, s.d) / (s.length * s.length);
        const Vec3 line =
            s.shape.shape == ShapeKind::cone ? cone_generator(s.shape, radial(n)) : Vec3(0, 0, 1);
        s.side(n, glm::dot(n, x - s.probe.tip), place,
               std::min(angle_to_plane(s.u, Vec3(0, 0, 1)), angle_to_line(s.u, line)));
      }
    }
    last = next;
  }
}

void out_of_sphere(Search& s) {
  const double radius = s.shape.radius;
  const auto add_end = [&](bool tail) {
    const Vec3& p = tail ? s.probe.tail : s.probe.tip;
    const double from = glm::length(p);
    s.end(tail, from > 0 ? p / from : Vec3(0, 0, 1), radius - from, kRight);
  };
  add_end(false);
  if (s.is_point()) return;
  add_end(true);
  const double place = -glm::dot(s.probe.tip, s.d) / (s.length * s.length);
  const Vec3 foot = s.probe.tip + place * s.d;
  const double from = glm::length(foot);
  // A probe through the centre: any direction across it.
  const Vec3 normal = from > 1e-12 * radius   ? foot / from
                      : std::abs(s.u.z) < 0.9 ? glm::normalize(glm::cross(s.u, Vec3(0, 0, 1)))
                                              : glm::normalize(glm::cross(s.u, Vec3(1, 0, 0)));
  s.side(normal, radius - from, place, kRight);
}

void out_of_cube(Search& s) {
  const double h = s.shape.edge / 2;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 normal;
      normal[axis] = sign;
      const double flat = angle_to_plane(s.u, normal);
      for (const bool tail : {false, true}) {
        const Vec3& p = tail ? s.probe.tail : s.probe.tip;
        if (std::abs(p[(axis + 1) % 3]) <= h && std::abs(p[(axis + 2) % 3]) <= h)
          s.end(tail, normal, h - sign * p[axis], flat);
      }
      if (s.is_point()) continue;
      // The edges along this axis: the normal chooses which.
      Vec3 line;
      line[axis] = 1;
      const Vec3 c = sign * glm::cross(line, s.u);
      const double width = glm::length(c);
      if (width == 0) continue;
      const Vec3 n = c / width;
      const int i = (axis + 1) % 3, k = (axis + 2) % 3;
      if (n[i] == 0 || n[k] == 0) continue;  // flat on a face
      Vec3 start;
      start[axis] = -h;
      start[i] = std::copysign(h, n[i]);
      start[k] = std::copysign(h, n[k]);
      const double before = s.u[i], beside = s.u[k];
      const double depth = glm::dot(n, start - s.probe.tip);
      const Vec3 w = s.probe.tip + depth * n - start;
      const Vec3 across = glm::cross(2 * h * line, s.d);
      const double c2 = glm::dot(across, across);
      const double along = glm::dot(glm::cross(w, s.d), across) / c2;
      if (along < 0 || along > 1) continue;
      s.side(n, depth, glm::dot(glm::cross(w, 2 * h * line), across) / c2,
             std::asin(std::min({1.0, std::abs(before), std::abs(beside)})));
    }
  }
}

void out_of_cylinder(Search& s) {
  const double radius = s.shape.radius, h = s.shape.height / 2;
  const Vec3 up(0, 0, 1);
  for (const bool tail : {false, true}) {
    const Vec3& p = tail ? s.probe.tail : s.probe.tip;
    if (tail && s.is_point()) break;
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 n(0, 0, sign);
      // Out past an end: on the disc only where the end of the probe is above it.
      if (std::hypot(p.x, p.y) <= radius) s.end(tail, n, h - sign * p.z, angle_to_plane(s.u, n));
    }
    if (std::abs(p.z) <= h)
      s.end(tail, radial(p), radius - std::hypot(p.x, p.y), angle_to_line(s.u, up));
  }
  if (s.is_point()) return;
  const Vec3 c = glm::cross(up, s.u);
  const double width = glm::length(c);
  for (const double sign : {-1.0, 1.0}) {
    if (width > 0) {
      const Vec3 n = sign * c / width;
      cross_line(s, n, radius * n - h * up, 2 * h * up);
    }
    cross_rim(s, sign * h, [&](const Vec3& n) { return n.z * sign > 0; });
  }
}

void out_of_cone(Search& s) {
  const double radius = s.shape.radius, height = s.shape.height;
  const Vec3 apex(0, 0, height / 2), down(0, 0, -1);
  for (const bool tail : {false, true}) {
    const Vec3& p = tail ? s.probe.tail : s.probe.tip;
    if (tail && s.is_point()) break;
    if (std::hypot(p.x, p.y) <= radius)
      s.end(tail, down, p.z + height / 2, angle_to_plane(s.u, down));
    const Vec3 out = radial(p), n = cone_normal(s.shape, out), line = cone_generator(s.shape, out);
    const double along = glm::dot(p - apex, line) / glm::dot(line, line);
    if (along >= 0 && along <= 1) s.end(tail, n, glm::dot(n, apex - p), angle_to_line(s.u, line));
  }
  if (s.is_point()) return;
  // Normals of the side at right angles to the probe: height (u.out) + radius u.z = 0.
  const double across = std::hypot(s.u.x, s.u.y);
  const double cosine = across > 0 ? -radius * s.u.z / (height * across) : 2;
  if (std::abs(cosine) <= 1) {
    const double about = std::atan2(s.u.y, s.u.x), turn = std::acos(cosine);
    for (const double angle : {about - turn, about + turn}) {
      const Vec3 out(std::cos(angle), std::sin(angle), 0);
      cross_line(s, cone_normal(s.shape, out), apex, cone_generator(s.shape, out));
    }
  }
  cross_rim(s, -height / 2, [&](const Vec3& n) {
    return radius * std::hypot(n.x, n.y) > height * n.z;  // farther out than the apex
  });
}

/// At most 0 inside the shape, above 0 outside; convex. Not a distance past rims and edges.
double outside_by(const ObjectSpec& s, const Vec3& p) {
  const double out = std::hypot(p.x, p.y);
  switch (s.shape) {
    case ShapeKind::sphere:
      return glm::length(p) - s.radius;
    case ShapeKind::cube:
      return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - s.edge / 2;
    case ShapeKind::cylinder:
      return std::max(out - s.radius, std::abs(p.z) - s.height / 2);
    default: {
      const Vec3 side = cone_normal(s, Vec3(1, 0, 0));
      return std::max(side.x * out + side.z * (p.z - s.height / 2), -p.z - s.height / 2);
    }
  }
}

/// Some point of the probe is within the shape: the least of a convex function by thirds.
bool overlaps(const ObjectSpec& shape, const LineProbe& probe) {
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

double support(const ObjectSpec& primitive, const Vec3& n) {
  const double out = primitive.radius * std::hypot(n.x, n.y), up = primitive.height / 2 * n.z;
  switch (primitive.shape) {
    case ShapeKind::sphere:
      return primitive.radius * glm::length(n);
    case ShapeKind::cube:
      return primitive.edge / 2 * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    case ShapeKind::cylinder:
      return out + std::abs(up);
    case ShapeKind::cone:
      return std::max(up, out - up);
    case ShapeKind::mesh:
    case ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("support: a mesh or compound is no analytic primitive");
}

double depth_along(const ObjectSpec& primitive, const LineProbe& probe, const Vec3& n) {
  return support(primitive, n) - std::min(glm::dot(n, probe.tip), glm::dot(n, probe.tail));
}

std::vector<WayOut> ways_out(const ObjectSpec& primitive, const LineProbe& probe) {
  support(primitive, Vec3());  // refuses what is no primitive
  if (!overlaps(primitive, probe)) return {};
  Search s(primitive, probe);
  switch (primitive.shape) {
    case ShapeKind::sphere:
      out_of_sphere(s);
      break;
    case ShapeKind::cube:
      out_of_cube(s);
      break;
    case ShapeKind::cylinder:
      out_of_cylinder(s);
      break;
    default:
      out_of_cone(s);
  }
  return s.sorted();
}

std::vector<WayOut> ways_out(const ConvexMesh& mesh, const LineProbe& probe, const Vec3& towards,
                             double angle) {
  const double least_cosine = angle < std::numbers::pi ? std::cos(angle) : -2;
  const double slack = 1e-12 * mesh.size();
  const Vec3 d = probe.tail - probe.tip;
  const double length = glm::length(d);
  const Vec3 u = length > 0 ? d / length : Vec3();
  const auto flatness = [&](const Facet& facet) {
    return length > 0 ? angle_to_plane(u, facet.normal) : kRight;
  };
  std::vector<WayOut> found;
  for (const Facet& facet : mesh.facets()) {
    if (glm::dot(facet.normal, towards) < least_cosine) continue;
    const bool tail = glm::dot(facet.normal, d) < 0;
    const Vec3& end = tail ? probe.tail : probe.tip;
    const double depth = facet.offset - glm::dot(facet.normal, end);
    if (depth < 0) return {};  // a plane between them
    const Vec3 foot = end + depth * facet.normal;
    bool over = true;
    for (std::uint32_t i = 0; over && i < facet.side_count; ++i) {
      const Side& side = mesh.sides()[facet.first_side + i];
      over = glm::dot(side.inward, foot) >= side.offset - slack;
    }
    if (over) found.push_back({facet.normal, depth, tail ? 1.0 : 0.0, flatness(facet)});
  }
  for (const Edge& edge : mesh.edges()) {
    const Facet &left = mesh.facets()[edge.left], &right = mesh.facets()[edge.right];
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
    const double place = glm::dot(glm::cross(w, line), c) / c2;
    const double beyond_edge = slack / glm::length(line), beyond_end = slack / length;
    if (along < -beyond_edge || along > 1 + beyond_edge) continue;
    if (place < -beyond_end || place > 1 + beyond_end) continue;
    found.push_back(
        {n, depth, std::clamp(place, 0.0, 1.0), std::min(flatness(left), flatness(right))});
  }
  std::sort(found.begin(), found.end(),
            [](const WayOut& a, const WayOut& b) { return a.depth < b.depth; });
  return found;
}

}  // namespace palpate
