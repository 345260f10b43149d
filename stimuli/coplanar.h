#pragma once
// Merging coplanar faces of a linked surface to facets. The second step of building a ConvexMesh.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/half_edges.h"
#include "stimuli/mesh_names.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// A face, as merging needs it.
struct FaceShape {
  double area = 0;    ///< m^2
  Vec3 normal;        ///< unit, outward; undefined when thin
  Vec3 middle;        ///< m, mean of the corners
  bool thin = false;  ///< degenerate: no wider than the error of its corners, so it has no plane
};
std::vector<FaceShape> shapes_of(const HalfEdges& mesh);

/// Reports polygons whose corners are not in one plane.
void check_flatness(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                    MeshFaults& faults);

/// The deviation from one plane (convex_mesh.h) of the face of a half-edge and the face across.
double plane_deviation_at(const HalfEdges& mesh, const std::vector<FaceShape>& shapes,
                          HalfEdges::Index h);

/// For each face the number of the maximal planar region that it belongs to; regions are numbered
/// from 0 in the order of their first faces. \param[out] count the number of regions.
std::vector<HalfEdges::Index> coplanar_regions(const HalfEdges& mesh,
                                               const std::vector<FaceShape>& shapes,
                                               HalfEdges::Index& count);

/// The same, but merges degenerate faces only.
std::vector<HalfEdges::Index> single_regions(const HalfEdges& mesh,
                                             const std::vector<FaceShape>& shapes,
                                             HalfEdges::Index& count);

// The outlines of the maximal planar regions of a linked surface. The third step of building a
// ConvexMesh.

/// Region r has the sides first[r] .. first[r + 1], counter-clockwise seen from outside. A side may
/// run along several half-edges; the vertices between them are no corners.
struct FacetOutlines {
  using Index = HalfEdges::Index;

  std::vector<Index> first;
  std::vector<Index> start;     ///< of each side: the half-edge at its first corner
  std::vector<Index> opposite;  ///< of each side: the same side of the region across
  std::vector<Index> region;    ///< of each side

  Index region_count() const { return static_cast<Index>(first.size() - 1); }
  Index side_count() const { return static_cast<Index>(start.size()); }
};

/// A corner is a vertex where three or more regions meet. Reports regions with holes and regions
/// with fewer than three corners; the result is of use only when there are none.
FacetOutlines facet_outlines(const HalfEdges& mesh, const std::vector<HalfEdges::Index>& region_of,
                             HalfEdges::Index region_count, MeshFaults& faults);

// The sides of triangles, grouped by the edge that they run along.

/// Takes 12 bytes of memory for each side, and time in proportion to their number.
class SideGroups {
 public:
  /// A side of a triangle, from its corner k to the next.
  struct Side {
    std::uint32_t other;  ///< the higher end
    std::uint32_t code;   ///< 6 * triangle + 2 * k + (1: from the lower end to the higher)
    std::uint32_t triangle() const { return code / 6; }
    std::uint32_t k() const { return code % 6 / 2; }
    bool up() const { return code % 2 == 1; }
  };
  /// All sides between two vertices, by number of triangle.
  struct Edge {
    std::uint32_t low, high;
    std::span<const Side> sides;
  };

  SideGroups(std::size_t vertex_count, const std::vector<std::array<std::uint32_t, 3>>& triangles);

  /// Calls visit(Edge) for each edge, by number of its ends.
  template <class Visit>
  void for_each_edge(Visit visit) const {
    for (std::uint32_t v = 0; v + 1 < first_.size(); ++v) {
      for (std::uint32_t i = first_[v]; i < first_[v + 1];) {
        std::uint32_t end = i + 1;
        while (end < first_[v + 1] && sides_[end].other == sides_[i].other) ++end;
        visit(Edge{v, sides_[i].other, {sides_.data() + i, sides_.data() + end}});
        i = end;
      }
    }
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<Side> sides_;
};

/// The neighbour over each side. Along every edge as many triangles must run one way as the other.
/// Where there are more than two, each two neighbours have solid between them.
void link_triangles(const std::vector<Vec3>& vertices,
                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                    std::vector<std::array<std::uint32_t, 3>>& across);

}  // namespace palpate::stimuli
