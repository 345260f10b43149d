#include "rendering/facet_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/facet_walk.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

namespace {

/// The middle and the extent in each direction of a mesh's surface, as of a body.
struct Moments {
  Vec3 middle;
  std::array<std::array<double, 3>, 3> second{};  // m^2, about the middle

  explicit Moments(const stimuli::ConvexMesh& mesh) {
    double area = 0;
    Vec3 sum(0);
    for_each_triangle(mesh, [&](const Vec3& centroid, double a) {
      area += a;
      sum += a * centroid;
    });
    middle = sum / area;
    for_each_triangle(mesh, [&](const Vec3& centroid, double a) {
      const Vec3 arm = centroid - middle;
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) second[i][k] += a / area * arm[i] * arm[k];
      }
    });
  }

 private:
  template <class Visit>
  static void for_each_triangle(const stimuli::ConvexMesh& mesh, const Visit& visit) {
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const stimuli::Facet& facet = mesh.facets()[f];
      const Vec3& apex = minkowski::corner(mesh, f, mesh.sides()[facet.first_side]);
      for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
        const stimuli::Edge& edge = mesh.edges()[mesh.sides()[i].edge];
        const double area = 0.5 * glm::length(glm::cross(edge.from - apex, edge.to - apex));
        visit((apex + edge.from + edge.to) / 3.0, area);
      }
    }
  }
};

/// A ray from the middle of a mesh.
struct Ray {
  Vec3 from, along;

  /// The distance along the ray to the plane of a facet; infinite if the plane is not ahead.
  double until(const stimuli::Facet& facet) const {
    const double rate = glm::dot(facet.normal, along);
    return rate > 0 ? (facet.offset - glm::dot(facet.normal, from)) / rate : HUGE_VAL;
  }
};

/// The facet by which the ray leaves the mesh, found by a walk from the facet `start`.
std::uint32_t exit_facet(const stimuli::ConvexMesh& mesh, const Ray& ray, std::uint32_t start) {
  std::uint32_t at = start;
  double time = ray.until(mesh.facets()[at]);
  if (time == HUGE_VAL) {
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const double t = ray.until(mesh.facets()[f]);
      if (t < time) {
        time = t;
        at = f;
      }
    }
  }
  while (time < HUGE_VAL) {
    const std::uint32_t next = minkowski::beyond_side(mesh, at, ray.from + time * ray.along).across;
    if (next == minkowski::kNone) break;
    const double earlier = ray.until(mesh.facets()[next]);
    if (!(earlier < time)) break;
    time = earlier;
    at = next;
  }
  return at;
}

}  // namespace

FacetMap::FacetMap(const stimuli::ConvexMesh& mesh, std::size_t small_mesh,
                   double facets_per_cell) {
  if (mesh.vertices().size() <= small_mesh) return;
  const Moments moments(mesh);
  middle_ = moments.middle;
  // The Cholesky factor of the moments maps a ball to a body as wide as the mesh; its inverse maps
  // back.
  const auto& s = moments.second;
  const double least = 1e-12 * mesh.size() * mesh.size();
  const double a = std::sqrt(std::max(s[0][0], least));
  const double b = s[1][0] / a, c = s[2][0] / a;
  const double e = std::sqrt(std::max(s[1][1] - b * b, least));
  const double f = (s[2][1] - b * c) / e;
  const double g = std::sqrt(std::max(s[2][2] - c * c - f * f, least));
  row0_ = {1 / a, 0, 0};
  row1_ = {-b / (a * e), 1 / e, 0};
  row2_ = {(b * f / e - c) / (a * g), -f / (e * g), 1 / g};

  directions_ =
      stimuli::DirectionCells::about(static_cast<double>(mesh.facets().size()) / facets_per_cell);
  cells_.resize(directions_.count());
  std::uint32_t facet = 0;
  directions_.visit_middles([&](std::size_t cell, const Vec3& u) {
    const Vec3 along(a * u.x, b * u.x + e * u.y, c * u.x + f * u.y + g * u.z);
    facet = exit_facet(mesh, {middle_, along}, facet);
    cells_[cell] = facet;
  });
}

Vec3 FacetMap::rounded(const Vec3& v) const {
  return {row0_.x * v.x, row1_.x * v.x + row1_.y * v.y, glm::dot(row2_, v)};
}

std::uint32_t FacetMap::facet_under(const Vec3& tip, const Vec3& d) const {
  const Vec3 to_tip = rounded(tip - middle_), along = rounded(d);
  const double length2 = glm::dot(along, along);
  const double fraction =
      length2 > 0 ? std::clamp(-glm::dot(to_tip, along) / length2, 0.0, 1.0) : 0;
  return cells_[directions_.cell_of(to_tip + fraction * along)];
}

std::uint32_t FacetMap::facet_under(const Vec3& p) const {
  return cells_[directions_.cell_of(rounded(p - middle_))];
}

}  // namespace palpate::rendering
