#pragma once
// Polyhedra as polygon soups for property tests. SI units; random ones are convex, centred at the
// origin.

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"

namespace palpate::testing {

/// The hull of points no four of which are coplanar, as outward triangles: starts with a
/// tetrahedron and adds point by point, replacing the faces that it sees. O(n^2), independent of
/// ConvexMesh on purpose.
inline stimuli::PolygonSoup hull_of(const std::vector<Vec3>& points) {
  using Triangle = std::array<std::uint32_t, 3>;
  const auto above = [&](const Triangle& t, std::uint32_t p) {
    return glm::dot(glm::cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]),
                    points[p] - points[t[0]]);
  };
  if (points.size() < 4) throw std::invalid_argument("hull_of: at least four points");
  std::vector<Triangle> faces;
  if (above({0, 1, 2}, 3) < 0) {
    faces = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  } else {
    faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  }
  for (std::uint32_t p = 4; p < points.size(); ++p) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> seen;  // sides of faces that p sees
    std::erase_if(faces, [&](const Triangle& t) {
      if (above(t, p) <= 0) return false;
      for (std::size_t k = 0; k < 3; ++k) seen.emplace(t[k], t[(k + 1) % 3]);
      return true;
    });
    for (const auto& [a, b] : seen) {
      if (!seen.contains({b, a})) faces.push_back({a, b, p});
    }
  }
  stimuli::PolygonSoup soup;
  soup.vertices = points;
  for (const Triangle& t : faces) soup.faces.push_back({t[0], t[1], t[2]});
  return soup;
}

/// The hull of `points` random points on an ellipsoid (every point is a corner).
inline stimuli::PolygonSoup random_polyhedron(Random& random, int points, const Vec3& semi_axes) {
  std::vector<Vec3> corners;
  for (int i = 0; i < points; ++i) {
    corners.push_back(semi_axes * (stimuli::uniform_rotation(random) * Vec3(0, 0, 1)));
  }
  return hull_of(corners);
}

/// A regular prism about the z axis; side faces are quadrilaterals.
inline stimuli::PolygonSoup prism(int sides, double radius, double height) {
  stimuli::PolygonSoup soup;
  const auto n = static_cast<std::uint32_t>(sides);
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / sides;
    const double x = radius * std::cos(angle), y = radius * std::sin(angle);
    soup.vertices.emplace_back(x, y, -height / 2);
    soup.vertices.emplace_back(x, y, height / 2);
    bottom.push_back(2 * (n - 1 - k));
    top.push_back(2 * k + 1);
    const std::uint32_t next = (k + 1) % n;
    soup.faces.push_back({2 * k, 2 * next, 2 * next + 1, 2 * k + 1});
  }
  soup.faces.push_back(bottom);
  soup.faces.push_back(top);
  return soup;
}

/// A bar of square section along z: `length` long, `width` from corner to opposite corner.
inline stimuli::PolygonSoup needle(double length, double width) {
  return prism(4, width / 2, length);
}

/// A square plate across z.
inline stimuli::PolygonSoup plate(double edge, double thickness) {
  return prism(4, edge / std::numbers::sqrt2, thickness);
}

/// Every polygon cut into triangles from its first corner.
inline stimuli::PolygonSoup triangulated(const stimuli::PolygonSoup& soup) {
  stimuli::PolygonSoup out;
  out.vertices = soup.vertices;
  out.coordinate_error = soup.coordinate_error;
  for (const auto& face : soup.faces) {
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      out.faces.push_back({face[0], face[k], face[k + 1]});
    }
  }
  return out;
}

/// A prism along y over a polygon in x and z, counter-clockwise seen along +y from behind.
inline stimuli::PolygonSoup prism(const std::vector<std::array<double, 2>>& outline,
                                  double half_depth) {
  stimuli::PolygonSoup soup;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {-half_depth, half_depth}) {
    for (const auto& [x, z] : outline) soup.vertices.emplace_back(x, y, z);
  }
  auto& front = soup.faces.emplace_back();
  for (std::uint32_t i = 0; i < n; ++i) front.push_back(i);
  auto& back = soup.faces.emplace_back();
  for (std::uint32_t i = n; i-- > 0;) back.push_back(n + i);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    soup.faces.push_back({k, i, n + i, n + k});
  }
  return soup;
}

/// Turned, scaled by `scale` and then moved.
inline stimuli::PolygonSoup placed(stimuli::PolygonSoup soup, const Quat& turn, double scale,
                                   const Vec3& to) {
  for (Vec3& vertex : soup.vertices) vertex = scale * (turn * vertex) + to;
  return soup;
}

}  // namespace palpate::testing
