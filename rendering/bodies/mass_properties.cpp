#include "rendering/bodies/mass_properties.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace palpate::rendering {
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
  double tolerance = 0;         ///< m
};

PlacedPart placed_part(const PlacedMesh& placed) {
  PlacedPart part;
  const stimuli::ConvexMesh& mesh = *placed.mesh;
  for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
    const stimuli::Facet& facet = mesh.facets()[f];
    Polygon& polygon = part.facets.emplace_back();
    for (std::uint32_t k = 0; k < facet.side_count; ++k) {
      const stimuli::Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
      polygon.push_back(placed.pose.orientation * (edge.left == f ? edge.from : edge.to) +
                        placed.pose.position);
    }
    const Vec3 normal = placed.pose.orientation * facet.normal;
    part.planes.push_back({normal, facet.offset + glm::dot(normal, placed.pose.position)});
  }
  part.tolerance = 1e-10 * mesh.size();
  return part;
}

/// Adds what the tetrahedra from the origin to a polygon hold, signed.
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

/// Divides a polygon by a plane. \return what is outside; `polygon` keeps the rest
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

  /// \param of  the part that the polygon is of. \param from  the first part it is held against
  void add(Polygon polygon, const Vec3& normal, std::size_t of, std::size_t from) {
    while (from < parts_.size() && (from == of || is_beyond(polygon, normal, of, from))) ++from;
    if (from == parts_.size()) {
      add_polygon(polygon, out_);
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

  /// Whether one plane has all of the polygon on its outer side. Where two facets coincide, the
  /// first part's counts; where two parts abut, none.
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
  UnionSurface surface(placed, moments);
  for (std::size_t i = 0; i < placed.size(); ++i) surface.add_part(i);
  moments.about = middle;
  return moments;
}

MassProperties with_density(const VolumeMoments& moments, double density) {
  return scaled(moments, density);
}

MassProperties with_mass(const VolumeMoments& moments, double mass) {
  return scaled(moments, mass / moments.volume);
}

}  // namespace palpate::rendering
