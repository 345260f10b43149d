#pragma once
// A closed convex polyhedron, prepared for local search: facets (coplanar faces merged), edges with
// their two facets, the fan of edges around every vertex. The mesh's own frame, SI units.

#include <array>
#include <cstdint>

#include "stimuli/large_array.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// One side of a facet's polygon, in counter-clockwise order seen from outside.
struct Side {
  Vec3 inward;    ///< unit, in the facet's plane, pointing into the polygon
  double offset;  ///< m; a point p of the plane is on the inner side when dot(inward, p) >= offset
  std::uint32_t edge;    ///< index into edges
  std::uint32_t across;  ///< the facet beyond this side
};

/// The edge and the facet beyond a side.
struct Neighbour {
  std::uint32_t edge = 0;    ///< index into edges
  std::uint32_t across = 0;  ///< index into facets
};

/// A maximal planar polygon of the surface. One cache line: a step from triangle to triangle on a
/// large mesh then reads nothing but facets.
struct alignas(64) Facet {
  Vec3 normal;               ///< unit, outward
  double offset;             ///< m; the plane is dot(normal, p) == offset
  std::uint32_t first_side;  ///< its sides are sides[first_side .. first_side + side_count)
  std::uint32_t side_count;
  std::array<Neighbour, 3> triangle;  ///< of the three sides, in order; triangles only
};

/// An edge between two facets that are not coplanar. Seen from outside, with v0 below and v1 above,
/// `left` and `right` are the facets on those hands: v0 -> v1 is counter-clockwise in `left`. One
/// cache line with its ends, so that a step to an edge reads no vertices.
struct alignas(64) Edge {
  std::uint32_t v0, v1;
  std::uint32_t left, right;
  Vec3 from, to;  ///< m; positions of v0 and v1
};

/// Immutable after construction. Facets, edges and vertices that are close in space are close in
/// memory. Every vertex is a corner of at least three facets (vertices inside a
/// merged facet or along a straight edge are dropped).
class ConvexMesh {
 public:
  /// Merges duplicate vertices and coplanar neighbours, checks that the result is closed, convex
  /// and consistently outward. Tolerances are relative to the size of the object.
  /// \throws MeshError naming every kind of fault.
  explicit ConvexMesh(const PolygonSoup& soup);

  const LargeArray<Vec3>& vertices() const { return vertices_; }
  const LargeArray<Facet>& facets() const { return facets_; }
  const LargeArray<Side>& sides() const { return sides_; }
  const LargeArray<Edge>& edges() const { return edges_; }
  PolygonSoup polygons() const;  ///< its vertices and facets, in their order

  /// Edges around vertex v, counter-clockwise seen from outside:
  /// fan_edges()[fan_first()[v] .. fan_first()[v + 1]).
  const LargeArray<std::uint32_t>& fan_first() const { return fan_first_; }
  const LargeArray<std::uint32_t>& fan_edges() const { return fan_edges_; }

  Vec3 centre() const { return centre_; }      ///< of the bounding sphere, m
  double radius() const { return radius_; }    ///< of the bounding sphere, m
  double size() const { return 2 * radius_; }  ///< m; the length that tolerances are relative to

 private:
  class Builder;

  LargeArray<Vec3> vertices_;
  LargeArray<Facet> facets_;
  LargeArray<Side> sides_;
  LargeArray<Edge> edges_;
  LargeArray<std::uint32_t> fan_first_, fan_edges_;
  Vec3 centre_;
  double radius_ = 0;
};

}  // namespace palpate::stimuli
