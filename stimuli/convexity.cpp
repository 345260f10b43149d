#include "stimuli/convexity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "stimuli/plane_deviation.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

// Whether a closed plane polygon without reflex corners, given by the directions of its sides,
// turns by 360 degrees and no more: then their components along any axis of the plane change sign
// exactly twice. Several axes, because close to zero a sign may be rounding.
bool turns_once(const std::vector<Vec3>& directions, const Vec3& normal) {
  const Vec3 u = glm::normalize(directions[0]), v = glm::cross(normal, u);
  constexpr std::array<std::array<double, 2>, 3> kAxes{{{0.8, 0.6}, {-0.28, 0.96}, {0.6, -0.8}}};
  for (const auto& [along, aside] : kAxes) {
    const Vec3 axis = along * u + aside * v;
    int changes = 0;
    bool was_positive = glm::dot(directions.back(), axis) >= 0;
    for (const Vec3& direction : directions) {
      const bool positive = glm::dot(direction, axis) >= 0;
      if (positive != was_positive) ++changes;
      was_positive = positive;
    }
    if (changes == 2) return true;
  }
  return false;
}

Index other_end(const Edge& edge, Index vertex) { return edge.v0 == vertex ? edge.v1 : edge.v0; }

class Checker {
 public:
  Checker(const ConvexMesh& mesh, const std::vector<Index>& soup_vertex, const MeshNaming& naming,
          double error, MeshFaults& faults)
      : mesh_(mesh), soup_vertex_(soup_vertex), naming_(naming), error_(error), faults_(faults) {}

  void check_facet(Index facet) {
    const Facet& shape = mesh_.facets()[facet];
    directions_.clear();
    Index lowest = corner(facet, 0);
    for (Index k = 0; k < shape.side_count; ++k) {
      const Index here = corner(facet, k), next = corner(facet, (k + 1) % shape.side_count);
      directions_.push_back(position(next) - position(here));
      if (valence(here) < valence(lowest)) lowest = here;
    }
    if (!turns_once(directions_, shape.normal)) {
      faults_.add("wound facet", [&] {
        return "the facet with the vertices " + names(facet) +
               " winds round more than once; expected a convex polygon";
      });
      return;
    }
    check_plane(facet, lowest);
  }

  // Edges were checked before facets were merged. But concave edges within the error merge as well,
  // and many of them add up to concave edges between facets that are beyond it.
  void check_edge(Index number) {
    const Edge& edge = mesh_.edges()[number];
    const Vec3 side = position(edge.v1) - position(edge.v0);
    const double deviation = plane_deviation(
        mesh_.facets()[edge.left].normal, mesh_.facets()[edge.right].normal, side,
        extent_of(edge.left, edge.v0, side), extent_of(edge.right, edge.v1, -side), error_);
    if (deviation >= -2 * kCoplanar) return;
    faults_.add("not convex", [&] {
      return "the facets with the vertices " + names(edge.left) + " and " + names(edge.right) +
             " form a dent; expected convex edges only";
    });
  }

  void check_vertex(Index vertex) {
    const auto& fan = mesh_.fan_edges();
    const Index first = mesh_.fan_first()[vertex], end = mesh_.fan_first()[vertex + 1];
    Vec3 inside;
    for (Index k = first; k < end; ++k) inside -= leaving_facet(fan[k], vertex).normal;
    inside = glm::normalize(inside);
    // The edges, seen from inside along this direction, are the corners of a plane polygon.
    corners_.clear();
    for (Index k = first; k < end; ++k) {
      const Vec3 along =
          glm::normalize(position(other_end(mesh_.edges()[fan[k]], vertex)) - position(vertex));
      const double ahead = glm::dot(along, inside);
      if (!(ahead > 0)) return;  // flat within rounding: nothing can wind round
      corners_.push_back(along / ahead);
    }
    directions_.clear();
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      directions_.push_back(corners_[(k + 1) % corners_.size()] - corners_[k]);
    }
    if (turns_once(directions_, inside)) return;
    faults_.add("wound vertex", [&] {
      return "the faces wind round " + name(vertex) + " more than once; expected a convex corner";
    });
  }

 private:
  const Vec3& position(Index vertex) const { return mesh_.vertices()[vertex]; }
  Index valence(Index v) const { return mesh_.fan_first()[v + 1] - mesh_.fan_first()[v]; }

  Index corner(Index facet, Index k) const {
    const Edge& edge = mesh_.edges()[mesh_.sides()[mesh_.facets()[facet].first_side + k].edge];
    return edge.left == facet ? edge.v0 : edge.v1;
  }

  PolygonExtent extent_of(Index facet, Index from, const Vec3& side) const {
    const Index corners = mesh_.facets()[facet].side_count;
    // A sample of the corners of a large facet is enough.
    const Index stride = std::max<Index>(1, corners / 16);
    PolygonExtent extent(side);
    for (Index k = 0; k < corners; k += stride) {
      extent.include(position(corner(facet, k)) - position(from));
    }
    return extent;
  }

  const Facet& leaving_facet(Index edge, Index vertex) const {
    const Edge& e = mesh_.edges()[edge];
    return mesh_.facets()[e.v0 == vertex ? e.left : e.right];
  }

  std::string label(Index vertex) const {
    return naming_.label(soup_vertex_[vertex], position(vertex));
  }
  std::string name(Index vertex) const {
    return naming_.vertex(soup_vertex_[vertex], position(vertex));
  }

  std::string names(Index facet) const {
    std::string text;
    for (Index k = 0; k < std::min<Index>(mesh_.facets()[facet].side_count, 8); ++k) {
      text += (k == 0 ? "" : " ") + label(corner(facet, k));
    }
    return text + (mesh_.facets()[facet].side_count > 8 ? " ..." : "");
  }

  // Hill climbing along the facet's normal from one of its corners; on a convex body it stays
  // there.
  void check_plane(Index facet, Index from) {
    const Facet& shape = mesh_.facets()[facet];
    Index top = from;
    double height = 16 * kCoplanar * error_;
    for (bool climbing = true; climbing;) {
      climbing = false;
      const Index here = top;
      for (Index k = mesh_.fan_first()[here]; k < mesh_.fan_first()[here + 1]; ++k) {
        const Index next = other_end(mesh_.edges()[mesh_.fan_edges()[k]], here);
        const double above = glm::dot(shape.normal, position(next)) - shape.offset;
        if (above <= height) continue;
        top = next;
        height = above;
        climbing = true;
      }
    }
    if (top == from) return;
    faults_.add("not convex", [&] {
      return name(top) + " stands " + std::to_string(height / mesh_.size()) +
             " of the object's size in front of the facet with the vertices " + names(facet);
    });
  }

  const ConvexMesh& mesh_;
  const std::vector<Index>& soup_vertex_;
  const MeshNaming& naming_;
  double error_;
  MeshFaults& faults_;
  std::vector<Vec3> directions_, corners_;
};

}  // namespace

void check_convexity(const ConvexMesh& mesh, const std::vector<Index>& soup_vertex,
                     const MeshNaming& naming, double error, MeshFaults& faults) {
  Checker checker(mesh, soup_vertex, naming, error, faults);
  for (Index f = 0; f < mesh.facets().size(); ++f) checker.check_facet(f);
  for (Index e = 0; e < mesh.edges().size(); ++e) checker.check_edge(e);
  for (Index v = 0; v < mesh.vertices().size(); ++v) checker.check_vertex(v);
}

}  // namespace palpate::stimuli
