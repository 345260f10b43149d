#include "rendering/separation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "stimuli/convex_mesh.h"
#include "stimuli/surfaces/support_map.h"

namespace palpate::rendering {
namespace {

/// 1 to 4 corners in the Minkowski difference of segment and mesh.
struct Simplex {
  std::array<Vec3, 4> corners;
  int count = 0;
};

/// The point of a simplex nearest the origin, and the corners that span it.
struct Nearest {
  Simplex carrier;
  Vec3 point;
};

Nearest nearest_on_point(const Vec3& a) { return {{{a}, 1}, a}; }

Nearest nearest_on_segment(const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = glm::dot(ab, ab);
  const double t = length2 > 0 ? -glm::dot(a, ab) / length2 : 0;
  if (t <= 0) return nearest_on_point(a);
  if (t >= 1) return nearest_on_point(b);
  return {{{a, b}, 2}, a + t * ab};
}

// Ericson 2005, Real-Time Collision Detection, 5.1.5, with the origin as the point.
Nearest nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -glm::dot(ab, a), d2 = -glm::dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return nearest_on_point(a);
  const double d3 = -glm::dot(ab, b), d4 = -glm::dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return nearest_on_point(b);
  const double d5 = -glm::dot(ab, c), d6 = -glm::dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return nearest_on_point(c);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return nearest_on_segment(a, b);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return nearest_on_segment(a, c);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return nearest_on_segment(b, c);
  const Vec3 n = glm::cross(ab, ac);
  const double n2 = glm::dot(n, n);
  if (n2 == 0) return nearest_on_segment(a, b);
  return {{{a, b, c}, 3}, glm::dot(n, a) / n2 * n};
}

Nearest nearest_on_tetrahedron(const std::array<Vec3, 4>& p) {
  static constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  Nearest best{{p, 4}, Vec3(0)};
  double best2 = -1;
  for (const auto& face : kFaces) {
    const Vec3 &a = p[face[0]], &b = p[face[1]], &c = p[face[2]];
    const Vec3 n = glm::cross(b - a, c - a);
    // The origin and the fourth corner on different sides (or a flat tetrahedron): a candidate
    // face.
    if (glm::dot(n, -a) * glm::dot(n, p[face[3]] - a) > 0) continue;
    const Nearest nearest = nearest_on_triangle(a, b, c);
    const double distance2 = glm::dot(nearest.point, nearest.point);
    if (best2 < 0 || distance2 < best2) {
      best2 = distance2;
      best = nearest;
    }
  }
  return best;
}

Nearest nearest_to_origin(const Simplex& s) {
  switch (s.count) {
    case 1:
      return nearest_on_point(s.corners[0]);
    case 2:
      return nearest_on_segment(s.corners[0], s.corners[1]);
    case 3:
      return nearest_on_triangle(s.corners[0], s.corners[1], s.corners[2]);
    default:
      return nearest_on_tetrahedron(s.corners);
  }
}

}  // namespace

void find_separating_plane(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& tail,
                           double tolerance, SeparatingPlane& plane, std::uint32_t& support,
                           const stimuli::SupportMap* map) {
  constexpr int kIterations = 40;
  Vec3 direction = plane.normal;
  if (!(glm::dot(direction, direction) > 0.5)) direction = 0.5 * (tip + tail) - mesh.centre();
  if (!(glm::dot(direction, direction) > 0)) direction = Vec3(1, 0, 0);
  plane.valid = false;
  double best_gap = -tolerance;
  // Upper bound: the distance to the nearest point of the current simplex; 0 before there is one.
  double distance = 0;
  Simplex simplex;
  for (int i = 0; i < kIterations; ++i) {
    const double length = glm::length(direction);
    const Vec3 n = direction / length;
    if (map != nullptr) {
      const std::uint32_t near = map->near_support(n);
      const auto& vertices = mesh.vertices();
      if (glm::dot(n, vertices[near]) > glm::dot(n, vertices[support])) support = near;
    }
    support = stimuli::support_vertex(mesh, n, support);
    const Vec3& lower_end = glm::dot(n, tip) <= glm::dot(n, tail) ? tip : tail;
    const Vec3 w = lower_end - mesh.vertices()[support];
    const double gap = glm::dot(n, w);
    if (gap > best_gap) {
      best_gap = gap;
      plane = {n, glm::dot(n, mesh.vertices()[support]), true};
    }
    if (best_gap > 0 && best_gap >= 0.5 * distance && simplex.count > 0) return;
    for (int k = 0; k < simplex.count; ++k) {
      if (simplex.corners[k] == w) return;  // no progress beyond rounding
    }
    simplex.corners[simplex.count++] = w;
    const Nearest nearest = nearest_to_origin(simplex);
    simplex = nearest.carrier;
    direction = nearest.point;
    distance = glm::length(direction);
    if (simplex.count == 4 || distance <= 1e-16 * mesh.size()) return;
  }
}

}  // namespace palpate::rendering
