#include "stimuli/surfaces/mass_properties.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "stimuli/bounding_tree.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/surfaces/surface_search.h"

namespace palpate::stimuli {
namespace {

using Polygon = std::vector<Vec3>;

struct CutPlane {
  Vec3 normal;  ///< unit, out of the part
  double offset = 0;
};

/// A part in the frame of the object.
struct PlacedPart {
  std::vector<CutPlane> planes;
  std::vector<Polygon> facets;  ///< as planes
  Vec3 centre;
  double tolerance = 0;  ///< m
};

PlacedPart placed_part(const PlacedMesh& placed) {
  PlacedPart part;
  const ConvexMesh& mesh = *placed.mesh;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const Facet& facet = mesh.facets()[f];
    Polygon& polygon = part.facets.emplace_back();
    for (std::uint32_t k = 0; k < facet.side_count; ++k) {
      const Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
      polygon.push_back(placed.pose.orientation * (edge.left == f ? edge.from : edge.to) +
                        placed.pose.position);
    }
    const Vec3 normal = placed.pose.orientation * facet.normal;
    part.planes.push_back({normal, facet.offset + glm::dot(normal, placed.pose.position)});
  }
  part.centre = placed.pose.orientation * mesh.centre() + placed.pose.position;
  part.tolerance = 1e-10 * mesh.size();
  return part;
}

/// Enlarges a part about its centre by a share of its size.
void grow(PlacedPart& part, double share) {
  for (CutPlane& plane : part.planes)
    plane.offset += share * (plane.offset - glm::dot(plane.normal, part.centre));
  for (Polygon& facet : part.facets) {
    for (Vec3& corner : facet) corner += share * (corner - part.centre);
  }
}

/// Adds the signed moments of the tetrahedra from the origin to a polygon.
void add_polygon(const Polygon& polygon, VolumeMoments& out) {
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[0], &b = polygon[k - 1], &c = polygon[k];
    const double six_volumes = glm::dot(a, glm::cross(b, c));
    const Vec3 sum = a + b + c;
    out.volume += six_volumes / 6;
    out.first += six_volumes / 24 * sum;
    out.second += six_volumes / 120 *
                  (glm::outerProduct(a, a) + glm::outerProduct(b, b) + glm::outerProduct(c, c) +
                   glm::outerProduct(sum, sum));
  }
}

/// Divides a polygon by a plane.
/// \return the piece outside; `polygon` keeps the rest
Polygon cut_off(Polygon& polygon, const CutPlane& plane) {
  Polygon outside, inside;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    const double at_p = glm::dot(plane.normal, p) - plane.offset;
    const double at_q = glm::dot(plane.normal, q) - plane.offset;
    (at_p > 0 ? outside : inside).push_back(p);
    if ((at_p > 0) == (at_q > 0)) continue;
    const Vec3 between = p + at_p / (at_p - at_q) * (q - p);
    outside.push_back(between);
    inside.push_back(between);
  }
  polygon = std::move(inside);
  return outside;
}

/// Adds the pieces of one part's facets that lie outside of all other parts.
class UnionSurface {
 public:
  UnionSurface(const std::vector<PlacedPart>& parts, VolumeMoments& out)
      : parts_(parts), out_(out) {}

  void add_part(std::size_t index) {
    for (std::size_t f = 0; f < parts_[index].facets.size(); ++f)
      add(parts_[index].facets[f], parts_[index].planes[f].normal, index, 0);
  }

  /// Whether the pieces added bound a solid: their areas add up to no vector, and they give the
  /// same volume along each axis, except for a share.
  bool is_closed(double share) const {
    if (!(glm::length(areas_) <= share * area_)) return false;
    const Mat3 error = along_ - out_.volume * Mat3(1);
    double most = 0;
    for (int axis = 0; axis < 3; ++axis) most = std::max(most, glm::length(error[axis]));
    return most <= share * out_.volume;
  }

 private:
  struct Extent {
    double least = HUGE_VAL, most = -HUGE_VAL;
  };

  static Extent extent_of(const Polygon& polygon, const CutPlane& plane) {
    Extent extent;
    for (const Vec3& p : polygon) {
      const double at = glm::dot(plane.normal, p) - plane.offset;
      extent.least = std::min(extent.least, at);
      extent.most = std::max(extent.most, at);
    }
    return extent;
  }

  /// \param of  the part that the polygon belongs to
  /// \param from  the first part that it is compared with
  void add(Polygon polygon, const Vec3& normal, std::size_t of, std::size_t from) {
    while (from < parts_.size() && (from == of || is_beyond(polygon, normal, of, from))) ++from;
    if (from == parts_.size()) {
      add_polygon(polygon, out_);
      check(polygon);
      return;
    }
    const PlacedPart& part = parts_[from];
    for (const CutPlane& plane : part.planes) {
      if (extent_of(polygon, plane).most <= part.tolerance) continue;
      const Polygon outside = cut_off(polygon, plane);
      if (outside.size() > 2) add(outside, normal, of, from + 1);
      if (polygon.size() < 3) return;
    }
  }

  void check(const Polygon& polygon) {
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      const Vec3 &a = polygon[0], &b = polygon[k - 1], &c = polygon[k];
      const Vec3 area = 0.5 * glm::cross(b - a, c - a);
      areas_ += area;
      area_ += glm::length(area);
      along_ += glm::outerProduct((a + b + c) / 3.0, area);
    }
  }

  /// Whether one plane has the whole polygon on its outer side. Of two coinciding facets, the first
  /// part's counts; of two abutting ones, neither.
  bool is_beyond(const Polygon& polygon, const Vec3& normal, std::size_t of,
                 std::size_t other) const {
    const PlacedPart& part = parts_[other];
    return std::any_of(part.planes.begin(), part.planes.end(), [&](const CutPlane& plane) {
      const Extent extent = extent_of(polygon, plane);
      if (extent.least < -part.tolerance) return false;
      if (extent.most > part.tolerance) return true;
      return glm::dot(normal, plane.normal) > 0 && of < other;
    });
  }

  const std::vector<PlacedPart>& parts_;
  VolumeMoments& out_;
  Vec3 areas_{0};    // m^2
  double area_ = 0;  // m^2
  Mat3 along_{0};    // m^3; sum of places times areas
};

MassProperties scaled(const VolumeMoments& moments, double density) {
  MassProperties out;
  out.mass = density * moments.volume;
  const Vec3 centre = moments.first / moments.volume;
  out.centre = moments.about + centre;
  const Mat3 second = moments.second - moments.volume * glm::outerProduct(centre, centre);
  const double trace = second[0][0] + second[1][1] + second[2][2];
  out.inertia = density * (trace * Mat3(1) - second);
  return out;
}

constexpr double kClosed = 1e-6;  // share of area and volume

/// Adds up the outer surface of the parts. \return whether it bounds a solid, except for a share
bool add_union(const std::vector<PlacedPart>& parts, double share, VolumeMoments& out) {
  out = {};
  UnionSurface surface(parts, out);
  for (std::size_t i = 0; i < parts.size(); ++i) surface.add_part(i);
  return surface.is_closed(share);
}

/// Parts of a file with rounded coordinates abut with steps: then some faces between them may count
/// although those of the other part do not. Enlarged unequally, they overlap. The moments of two
/// sizes are extrapolated to the parts' own; if no two bound a solid, the last are taken.
void add_grown_union(const std::vector<PlacedPart>& parts, VolumeMoments& out) {
  constexpr double kLeast = 1e-9, kMost = 1e-2;  // of their size
  bool was_closed = false;
  for (double share = kLeast; share < kMost; share *= 2) {
    std::vector<PlacedPart> grown = parts;
    for (std::size_t i = 0; i < grown.size(); ++i) {
      const double turns = (std::numbers::phi - 1) * (static_cast<double>(i) + 0.5);
      grow(grown[i], share * (1 + turns - std::floor(turns)));
    }
    const VolumeMoments smaller = out;
    const bool is_closed = add_union(grown, std::max(kClosed, share), out);
    if (was_closed && is_closed) {
      out.volume = 2 * smaller.volume - out.volume;
      out.first = 2.0 * smaller.first - out.first;
      out.second = 2.0 * smaller.second - out.second;
      return;
    }
    was_closed = is_closed;
  }
}

/// Whether some region just below one of up to 4,096 triangles is covered twice.
bool covers_twice(const Surface& surface) {
  constexpr std::size_t kAsked = 4096;
  constexpr double kBelow = 1e-7;  // of the size
  const std::vector<std::uint32_t>& triangles = surface.file_order();
  const std::size_t stride = 1 + triangles.size() / kAsked;
  for (std::size_t i = 0; i < triangles.size(); i += stride) {
    const SurfaceTriangle& t = surface.triangles()[triangles[i]];
    const Vec3 middle = (surface.vertices()[t.corners[0]] + surface.vertices()[t.corners[1]] +
                         surface.vertices()[t.corners[2]]) /
                        3.0;
    if (surface.winding(middle - kBelow * surface.size() * t.normal) > 1) return true;
  }
  return false;
}

/// Adds the inside portions of a line along z that represents an area around it.
class LineMoments {
 public:
  LineMoments(const Surface& surface, VolumeMoments& out) : surface_(surface), out_(out) {}

  /// \param from  below the surface, relative to `about`
  /// \param length  m, to above the surface
  void add(const Vec3& from, double length, double area) {
    crossings_.clear();
    const Vec3 way(0, 0, length);
    const Vec3 start = from + out_.about;
    surface_.near_segment(start, way, [&](std::uint32_t index) {
      const SurfaceTriangle& t = surface_.triangles()[index];
      if (t.normal.z == 0 || t.is_back()) return true;
      bool in = true, out = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = surface_.vertices()[t.corners[k]] - start;
        const Vec3 b = surface_.vertices()[t.corners[(k + 1) % 3]] - start;
        const double side = a.x * b.y - a.y * b.x;
        in &= side >= 0;
        out &= side <= 0;
      }
      if (in == out) return true;
      const Vec3 a = surface_.vertices()[t.corners[0]] - start;
      crossings_.push_back({from.z + glm::dot(t.normal, a) / t.normal.z, t.normal.z < 0 ? 1 : -1});
      return true;
    });
    std::sort(crossings_.begin(), crossings_.end(),
              [](const Crossing& a, const Crossing& b) { return a.z < b.z; });
    int inside = 0;
    for (std::size_t i = 0; i + 1 < crossings_.size(); ++i) {
      inside += crossings_[i].enters;
      if (inside > 0) add_piece(from, crossings_[i].z, crossings_[i + 1].z, area);
    }
  }

 private:
  struct Crossing {
    double z;    ///< m
    int enters;  ///< 1, or -1: leaves
  };

  void add_piece(const Vec3& at, double low, double high, double area) {
    const double volume = area * (high - low);
    const Vec3 middle(at.x, at.y, 0.5 * (low + high));
    out_.volume += volume;
    out_.first += volume * middle;
    out_.second += volume * glm::outerProduct(middle, middle);
    out_.second[2][2] += volume * (high - low) * (high - low) / 12;
  }

  const Surface& surface_;
  VolumeMoments& out_;
  std::vector<Crossing> crossings_;
};

/// Moments of the surface in its own frame, about its centre.
VolumeMoments own_moments(const Surface& surface) {
  VolumeMoments moments;
  moments.about = surface.centre();
  if (!covers_twice(surface)) {
    Polygon corners(3);
    for (const std::uint32_t index : surface.file_order()) {
      const SurfaceTriangle& t = surface.triangles()[index];
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = surface.vertices()[t.corners[k]] - moments.about;
      add_polygon(corners, moments);
    }
    return moments;
  }
  constexpr int kLines = 400;  // along each side
  Box box;
  for (const Vec3& v : surface.vertices()) box.add(v - moments.about);
  const auto& [low, high] = box;
  const double step_x = (high.x - low.x) / kLines, step_y = (high.y - low.y) / kLines;
  std::array<double, kLines> shifts{};
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    const double turns = (std::numbers::phi - 1) * (static_cast<double>(i) + 0.5);
    shifts[i] = turns - std::floor(turns);
  }
  LineMoments lines(surface, moments);
  for (int i = 0; i < kLines; ++i) {
    for (int k = 0; k < kLines; ++k) {
      // Shift rows by the golden ratio, so that lines sample a wall along x or y at all places.
      const Vec3 from(low.x + (i + shifts[static_cast<std::size_t>(k)]) * step_x,
                      low.y + (k + shifts[static_cast<std::size_t>(i)]) * step_y,
                      low.z - surface.radius());
      lines.add(from, high.z - low.z + 2 * surface.radius(), step_x * step_y);
    }
  }
  return moments;
}

}  // namespace

VolumeMoments moments_of_union(std::span<const PlacedMesh> parts) {
  std::vector<PlacedPart> placed;
  placed.reserve(parts.size());
  Vec3 middle(0);
  for (const PlacedMesh& part : parts)
    middle += (part.pose.orientation * part.mesh->centre() + part.pose.position) /
              static_cast<double>(parts.size());
  for (const PlacedMesh& part : parts) {
    PlacedMesh about = part;
    about.pose.position -= middle;
    placed.push_back(placed_part(about));
  }
  VolumeMoments moments;
  if (!add_union(placed, kClosed, moments)) add_grown_union(placed, moments);
  moments.about = middle;
  return moments;
}

VolumeMoments moments_of_surface(const Surface& surface, const Pose& pose) {
  const VolumeMoments own = own_moments(surface);
  const Mat3 turn = glm::mat3_cast(pose.orientation);
  return {turn * own.about + pose.position, own.volume, turn * own.first,
          turn * own.second * glm::transpose(turn)};
}

MassProperties with_density(const VolumeMoments& moments, double density) {
  return scaled(moments, density);
}

MassProperties with_mass(const VolumeMoments& moments, double mass) {
  return scaled(moments, mass / moments.volume);
}

}  // namespace palpate::stimuli
