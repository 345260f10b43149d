#include "stimuli/inset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/grid_hull.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

// Of the mesh's size:
constexpr double kCoordinateError = 1e-11;  // as of every mesh in double precision
constexpr double kThinnest = 1e-9;          // a thinner body counts as nothing
constexpr double kLeastEdge = 1e-9;         // shorter edges count as none

/// Lower triangle L of the points' second moments, L L^T (Cholesky): L^-1 makes the points equally
/// wide in every direction.
std::array<std::array<double, 3>, 3> spread_of(const std::vector<Vec3>& points) {
  std::array<std::array<double, 3>, 3> m{};
  for (const Vec3& p : points) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c <= r; ++c) m[r][c] += p[r] * p[c] / static_cast<double>(points.size());
    }
  }
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < c; ++k) m[c][c] -= m[c][k] * m[c][k];
    m[c][c] = std::sqrt(m[c][c]);
    for (int r = c + 1; r < 3; ++r) {
      for (int k = 0; k < c; ++k) m[r][c] -= m[r][k] * m[c][k];
      m[r][c] /= m[c][c];
    }
  }
  return m;
}

/// A linear map of the points leaves their hull's triangles as they are; the hull's grid is equally
/// fine in all directions, so a flat body is first made round.
void make_round(std::vector<Vec3>& points) {
  const auto spread = spread_of(points);
  for (Vec3& p : points) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < r; ++c) p[r] -= spread[r][c] * p[c];
      p[r] /= spread[r][r];
    }
  }
}

/// The point on three planes, by Gaussian elimination with full pivoting. Planes of neighbouring
/// facets of a fine mesh are nearly parallel: only the differences of their equations determine
/// where they meet, so these are computed in extended precision.
Vec3 common_point(const std::array<const HalfSpace*, 3>& planes) {
  using Real = long double;
  std::array<std::array<Real, 4>, 3> a{};
  for (int r = 0; r < 3; ++r)
    a[r] = {planes[r]->normal.x, planes[r]->normal.y, planes[r]->normal.z, planes[r]->offset};
  std::array<int, 3> column{0, 1, 2};
  for (int step = 0; step < 3; ++step) {
    int best_row = step, best_column = step;
    for (int r = step; r < 3; ++r) {
      for (int c = step; c < 3; ++c) {
        if (std::abs(a[r][column[c]]) <= std::abs(a[best_row][column[best_column]])) continue;
        best_row = r;
        best_column = c;
      }
    }
    std::swap(a[step], a[best_row]);
    std::swap(column[step], column[best_column]);
    for (int r = step + 1; r < 3; ++r) {
      const Real factor = a[r][column[step]] / a[step][column[step]];
      for (int c = 0; c < 4; ++c) a[r][c] -= factor * a[step][c];
    }
  }
  std::array<Real, 3> x{};
  for (int step = 2; step >= 0; --step) {
    Real rest = a[step][3];
    for (int c = step + 1; c < 3; ++c) rest -= a[step][column[c]] * x[column[c]];
    x[column[step]] = rest / a[step][column[step]];
  }
  return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}

/// A corner of a triangle of the hull, with the corner after it.
struct Spoke {
  Index from, to, triangle;
  bool operator<(const Spoke& other) const {
    return std::pair(from, to) < std::pair(other.from, other.to);
  }
};

/// For each vertex of a closed surface of triangles its triangles, counter-clockwise seen from
/// outside.
std::vector<std::vector<Index>> fans_of(const PolygonSoup& triangles) {
  std::vector<Spoke> spokes;
  spokes.reserve(3 * triangles.faces.size());
  for (Index t = 0; t < triangles.faces.size(); ++t) {
    const auto& corners = triangles.faces[t];
    for (int k = 0; k < 3; ++k) spokes.push_back({corners[k], corners[(k + 1) % 3], t});
  }
  std::sort(spokes.begin(), spokes.end());
  std::vector<std::vector<Index>> fans(triangles.vertices.size());
  for (auto first = spokes.begin(); first != spokes.end();) {
    const auto end =
        std::find_if(first, spokes.end(), [&](const Spoke& s) { return s.from != first->from; });
    std::vector<Index>& fan = fans[first->from];
    auto spoke = first;
    do {
      fan.push_back(spoke->triangle);
      const auto& corners = triangles.faces[spoke->triangle];
      const auto at = std::find(corners.begin(), corners.end(), first->from) - corners.begin();
      spoke = std::lower_bound(first, end, Spoke{first->from, corners[(at + 2) % 3], 0});
    } while (spoke != first);
    first = end;
  }
  return fans;
}

/// Merges neighbouring corners nearer than `least` (m) and drops facets that are no longer
/// polygons.
PolygonSoup without_short_edges(const PolygonSoup& soup, double least) {
  std::vector<Index> root(soup.vertices.size());
  std::iota(root.begin(), root.end(), Index{0});
  const auto find = [&root](Index v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& face : soup.faces) {
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Index a = face[k], b = face[(k + 1) % face.size()];
      if (glm::distance(soup.vertices[a], soup.vertices[b]) < least) root[find(a)] = find(b);
    }
  }
  PolygonSoup out;
  out.coordinate_error = soup.coordinate_error;
  std::vector<double> count(soup.vertices.size(), 0);
  std::vector<Index> number(soup.vertices.size(), 0);
  std::vector<Vec3> sum(soup.vertices.size());
  for (Index v = 0; v < soup.vertices.size(); ++v) {
    sum[find(v)] += soup.vertices[v] - soup.vertices[find(v)];
    count[find(v)] += 1;
  }
  for (Index v = 0; v < soup.vertices.size(); ++v) {
    if (find(v) != v) continue;
    number[v] = static_cast<Index>(out.vertices.size());
    out.vertices.push_back(soup.vertices[v] + sum[v] / count[v]);
  }
  for (const auto& face : soup.faces) {
    std::vector<Index> corners;
    for (const Index v : face) {
      const Index corner = number[find(v)];
      if (corners.empty() || corners.back() != corner) corners.push_back(corner);
    }
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
    if (corners.size() >= 3) out.faces.push_back(std::move(corners));
  }
  return out;
}

}  // namespace

std::shared_ptr<const ConvexMesh> body_behind(const std::vector<HalfSpace>& half_spaces,
                                              const Vec3& inside, double size) {
  // Duality about a point inside: a plane n.x = d is the point n/d, and the facets of the points'
  // convex hull are the vertices of the body behind the planes (Preparata & Shamos 1985, 7.2.5).
  // Points that are not on the hull are planes that bound nothing.
  std::vector<HalfSpace> planes;  // from the point inside
  std::vector<Vec3> duals;
  planes.reserve(half_spaces.size());
  duals.reserve(half_spaces.size());
  for (const HalfSpace& plane : half_spaces) {
    planes.push_back({plane.normal, plane.offset - glm::dot(plane.normal, inside)});
    duals.push_back(plane.normal / planes.back().offset);
  }
  make_round(duals);
  const GridHull hull = grid_hull(duals, 0);
  PolygonSoup soup;
  soup.vertices.reserve(hull.soup.faces.size());
  for (const auto& corners : hull.soup.faces) {
    soup.vertices.push_back(
        inside + common_point({&planes[hull.point[corners[0]]], &planes[hull.point[corners[1]]],
                               &planes[hull.point[corners[2]]]}));
  }
  soup.faces = fans_of(hull.soup);
  soup.coordinate_error = kCoordinateError * size;
  try {
    return std::make_shared<const ConvexMesh>(soup);
  } catch (const MeshError&) {
    // A corner of many facets splits when they move; the new corners are too close for a mesh.
    return std::make_shared<const ConvexMesh>(without_short_edges(soup, kLeastEdge * size));
  }
}

std::shared_ptr<const ConvexMesh> inset(const ConvexMesh& mesh, double depth) {
  const Ball ball = largest_inscribed_ball(mesh);
  if (!(ball.radius - depth > kThinnest * mesh.size())) return nullptr;
  std::vector<HalfSpace> moved;
  moved.reserve(mesh.facets().size());
  for (const Facet& facet : mesh.facets()) moved.push_back({facet.normal, facet.offset - depth});
  return body_behind(moved, ball.centre, mesh.size());
}

}  // namespace palpate::stimuli
