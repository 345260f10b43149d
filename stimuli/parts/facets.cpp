#include "stimuli/parts/facets.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/coplanar.h"
#include "stimuli/face_triangles.h"
#include "stimuli/mesh_names.h"
#include "stimuli/plane_deviation.h"

namespace palpate::stimuli {
namespace {

using Index = HalfEdges::Index;

struct Region {
  Vec3 normal;  // of length area
  double area = 0;
  std::vector<Vec3> corners;
  PlaneSide on;
};

std::vector<Region> regions_of(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                               const std::vector<Index>& region_of, Index count) {
  std::vector<Region> regions(count);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    Region& region = regions[region_of[f]];
    if (!shapes[f].thin) region.normal += shapes[f].area * shapes[f].normal;
    region.area += shapes[f].area;
    for (Index h = mesh.first[f]; h < mesh.first[f + 1]; ++h)
      region.corners.push_back(mesh.from(h));
  }
  return regions;
}

// Midway between the corners that stand out most and least, as in a ConvexMesh.
Plane plane_through(const Region& region) {
  Plane plane{glm::normalize(region.normal), 0};
  double low = plane.height(region.corners[0]), high = low;
  for (const Vec3& corner : region.corners) {
    low = std::min(low, plane.height(corner));
    high = std::max(high, plane.height(corner));
  }
  plane.offset = (low + high) / 2;
  return plane;
}

// The largest first: their planes are known best.
void number_planes(std::vector<Region>& regions, PlaneTable& planes) {
  std::vector<Index> order(regions.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return regions[a].area > regions[b].area; });
  for (const Index r : order) {
    regions[r].on = planes.number(plane_through(regions[r]), regions[r].corners);
  }
}

bool is_concave(const HalfEdges& mesh, const std::vector<FaceShape>& shapes, Index h,
                const Vec3& left, const Vec3& right) {
  const Index f = mesh.face[h], g = mesh.face[mesh.twin[h]];
  if (!shapes[f].thin && !shapes[g].thin) return plane_deviation_at(mesh, shapes, h) < -kCoplanar;
  // A degenerate face stands for a facet whose plane is known from its other faces.
  const Vec3 along = glm::normalize(mesh.to(h) - mesh.from(h));
  return glm::dot(glm::cross(left, right), along) < -1e-6;
}

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

/// Whether a simple plane polygon has no reflex corner (beyond rounding).
bool is_convex_polygon(std::span<const Vec3> corners, const Vec3& normal) {
  const std::size_t count = corners.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 &a = corners[k], &b = corners[(k + 1) % count], &c = corners[(k + 2) % count];
    if (sine_at(a, b, c, normal) < -kStraight) return false;
  }
  return true;
}

}  // namespace

FacetedSolid faceted_solid(const HalfEdges& mesh, PlaneTable& planes, MeshFaults& faults) {
  const std::vector<FaceShape> shapes = shapes_of(mesh);
  check_flatness(mesh, shapes, faults);
  FacetedSolid solid;
  solid.points = mesh.points;
  solid.size = mesh.size;
  solid.error = mesh.error;
  Index count = 0;
  const std::vector<Index> region_of = coplanar_regions(mesh, shapes, count);
  if (count == 0) faults.add("flat", [] { return "expected a solid, found lines only"; });
  if (!faults.empty()) return solid;
  std::vector<Region> regions = regions_of(mesh, shapes, region_of, count);
  number_planes(regions, planes);

  std::vector<Vec3> corners;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    corners.clear();
    for (Index h = mesh.first[f]; h < mesh.first[f + 1]; ++h) corners.push_back(mesh.from(h));
    const Region& region = regions[region_of[f]];
    const auto triangles = triangulate(corners, shapes[f].thin ? region.normal : shapes[f].normal);
    if (triangles.empty()) {
      faults.add("crossed face", [&] {
        return mesh.name_face(f) + ": expected a simple polygon, found one that crosses itself";
      });
    }
    solid.triangles.insert(solid.triangles.end(), triangles.begin(), triangles.end());
    if (shapes[f].thin) continue;
    if (is_convex_polygon(corners, shapes[f].normal)) {
      solid.surface.push_back({corners, region.on});
    } else {
      for (const auto& t : triangles) solid.surface.push_back({{t[0], t[1], t[2]}, region.on});
    }
  }
  for (Index h = 0; h < mesh.count(); ++h) {
    const Index twin = mesh.twin[h];
    if (twin == HalfEdges::kNone || twin < h) continue;
    const Index f = region_of[mesh.face[h]], g = region_of[mesh.face[twin]];
    if (f == g) continue;
    const Vec3 left = glm::normalize(regions[f].normal), right = glm::normalize(regions[g].normal);
    if (!is_concave(mesh, shapes, h, left, right)) continue;
    solid.concave.push_back({mesh.from(h),
                             mesh.to(h),
                             left,
                             right,
                             {regions[f].on, regions[g].on},
                             {mesh.origin[h], mesh.origin[mesh.next(h)]}});
  }
  return solid;
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
