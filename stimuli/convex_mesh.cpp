#include "stimuli/convex_mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "stimuli/convexity.h"
#include "stimuli/coplanar.h"
#include "stimuli/facet_outlines.h"
#include "stimuli/grid_hull.h"
#include "stimuli/half_edges.h"
#include "stimuli/polygon.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

// In errors: how far a corner may be below the hull of all; as far as it may be in front of a facet
// (convexity.cpp).
constexpr double kDeepest = 16 * kCoplanar;

struct Bulk {
  double volume = 0, area = 0;  // m^3, negative where it is inside out; m^2
};

Bulk bulk_of(const HalfEdges& mesh, const std::vector<FaceShape>& shapes) {
  Bulk bulk;
  for (const FaceShape& shape : shapes) {
    bulk.volume += glm::dot(shape.middle - mesh.points[0], shape.normal) * shape.area / 3;
    bulk.area += shape.area;
  }
  return bulk;
}

// Convex edges, volume and orientation, before any faces are merged.
void check_solid(const HalfEdges& mesh, const std::vector<FaceShape>& shapes, MeshFaults& faults) {
  check_flatness(mesh, shapes, faults);
  const auto [volume, area] = bulk_of(mesh, shapes);
  const bool closed =
      std::find(mesh.twin.begin(), mesh.twin.end(), HalfEdges::kNone) == mesh.twin.end();
  if (closed && !(std::abs(volume) > 2 * mesh.error * area)) {
    faults.add("flat", [] { return "expected a solid, found no volume"; });
    return;
  }
  if (closed && volume < 0) {
    faults.add("inside out", [] {
      return "all faces are clockwise seen from outside; expected counter-clockwise";
    });
  }
  const double outward = volume < 0 ? -1 : 1;
  for (Index h = 0; h < mesh.count(); ++h) {
    const Index twin = mesh.twin[h];
    if (twin == HalfEdges::kNone || twin < h) continue;
    if (shapes[mesh.face[h]].thin || shapes[mesh.face[twin]].thin) continue;
    if (outward * plane_deviation_at(mesh, shapes, h) >= -kCoplanar) continue;
    faults.add("not convex", [&] {
      return mesh.name_edge(h) + " is a dent against " + mesh.name_face(mesh.face[twin]) +
             "; expected convex edges only";
    });
  }
}

// Interleaves the bits of a position within the bounding box (Morton order, 1966): neighbours in
// this order are neighbours in space.
std::uint64_t morton(const Vec3& position, const Vec3& low, double extent) {
  const auto spread = [](double fraction) {
    auto bits = static_cast<std::uint64_t>(std::clamp(fraction, 0.0, 1.0) * 0x1fffff);
    bits = (bits | bits << 32U) & 0x001f00000000ffffU;
    bits = (bits | bits << 16U) & 0x001f0000ff0000ffU;
    bits = (bits | bits << 8U) & 0x100f00f00f00f00fU;
    bits = (bits | bits << 4U) & 0x10c30c30c30c30c3U;
    return (bits | bits << 2U) & 0x1249249249249249U;
  };
  const Vec3 fraction = (position - low) / extent;
  return spread(fraction.x) | spread(fraction.y) << 1U | spread(fraction.z) << 2U;
}

std::vector<Index> order_in_space(const HalfEdges& mesh, const FacetOutlines& outlines) {
  Vec3 low = mesh.points[0];
  for (const Vec3& point : mesh.points) low = glm::min(low, point);
  std::vector<std::pair<std::uint64_t, Index>> keys;
  keys.reserve(outlines.region_count());
  for (Index r = 0; r < outlines.region_count(); ++r) {
    Vec3 middle;
    for (Index s = outlines.first[r]; s < outlines.first[r + 1]; ++s) {
      middle += mesh.from(outlines.start[s]) - low;
    }
    middle /= static_cast<double>(outlines.first[r + 1] - outlines.first[r]);
    keys.emplace_back(morton(low + middle, low, mesh.size), r);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<Index> order;
  order.reserve(keys.size());
  for (const auto& [key, region] : keys) order.push_back(region);
  return order;
}

// The plane of a polygon, midway between the corners that stand out most and least.
Facet facet_of(const std::vector<Vec3>& corners) {
  Facet facet{plane_of(corners).normal, 0, 0, static_cast<Index>(corners.size()), {}};
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const Vec3& corner : corners) {
    low = std::min(low, glm::dot(facet.normal, corner));
    high = std::max(high, glm::dot(facet.normal, corner));
  }
  facet.offset = (low + high) / 2;
  return facet;
}

}  // namespace

/// Numbers and fills the arrays of a ConvexMesh from the outlines of its facets.
class ConvexMesh::Builder {
 public:
  Builder(ConvexMesh& out, const HalfEdges& mesh, const FacetOutlines& outlines)
      : out_(out),
        mesh_(mesh),
        outlines_(outlines),
        number_of_(outlines.region_count()),
        side_of_(outlines.side_count()),
        edge_of_(outlines.side_count(), HalfEdges::kNone),
        vertex_of_(mesh.points.size(), HalfEdges::kNone) {}

  /// From coplanar regions of faces; incomplete where there are faults.
  /// \return false where a region is no polygon
  static bool fill(ConvexMesh& out, const HalfEdges& mesh, const std::vector<Index>& region_of,
                   Index count, MeshFaults& faults);

  /// Where corners are closer than their error, some faces merge and others do not, so a merged
  /// region may be no polygon, and the faces themselves have concave edges within the error. The
  /// convex hull of the corners is used instead, if all of them lie on it within the error.
  static bool fill_from_hull(ConvexMesh& out, const HalfEdges& mesh,
                             const std::vector<FaceShape>& shapes);

  void build() {
    clear();
    const std::vector<Index> order = order_in_space(mesh_, outlines_);
    for (Index f = 0; f < order.size(); ++f) number_of_[order[f]] = f;
    out_.facets_.reserve(order.size());
    out_.sides_.reserve(outlines_.side_count());
    out_.edges_.reserve(outlines_.side_count() / 2);
    start_.reserve(outlines_.side_count());
    for (const Index region : order) add_facet(region);
    add_fans();
    add_sphere();
  }

  const std::vector<Index>& soup_vertex() const { return soup_vertex_; }

 private:
  void clear() {
    out_.vertices_.clear();
    out_.facets_.clear();
    out_.sides_.clear();
    out_.edges_.clear();
    out_.fan_first_.clear();
    out_.fan_edges_.clear();
    out_.radius_ = 0;
  }

  Index vertex(Index outline_side) {
    const Index point = mesh_.origin[outlines_.start[outline_side]];
    if (vertex_of_[point] == HalfEdges::kNone) {
      vertex_of_[point] = static_cast<Index>(out_.vertices_.size());
      out_.vertices_.push_back(mesh_.points[point]);
      soup_vertex_.push_back(mesh_.soup_vertex[point]);
    }
    return vertex_of_[point];
  }

  void add_facet(Index region) {
    const Index first = outlines_.first[region], end = outlines_.first[region + 1];
    corners_.clear();
    for (Index s = first; s < end; ++s) corners_.push_back(mesh_.from(outlines_.start[s]));
    Facet facet = facet_of(corners_);
    facet.first_side = static_cast<Index>(out_.sides_.size());
    out_.facets_.push_back(facet);
    for (Index s = first; s < end; ++s) {
      add_side(s, s + 1 == end ? first : s + 1, corners_[s - first],
               corners_[s + 1 == end ? 0 : s + 1 - first]);
    }
    if (facet.side_count == 3) {
      for (Index i = 0; i < 3; ++i) {
        const Side& side = out_.sides_[facet.first_side + i];
        out_.facets_.back().triangle[i] = {side.edge, side.across};
      }
    }
  }

  void add_side(Index s, Index next, const Vec3& from, const Vec3& to) {
    const Index opposite = outlines_.opposite[s];
    const Index across = number_of_[outlines_.region[opposite]];
    const Index v0 = vertex(s), v1 = vertex(next);
    if (edge_of_[opposite] == HalfEdges::kNone) {
      edge_of_[s] = static_cast<Index>(out_.edges_.size());
      out_.edges_.push_back({v0, v1, static_cast<Index>(out_.facets_.size() - 1), across,
                             out_.vertices_[v0], out_.vertices_[v1]});
    } else {
      edge_of_[s] = edge_of_[opposite];
    }
    side_of_[s] = static_cast<Index>(out_.sides_.size());
    start_.push_back(v0);
    const Vec3 inward =
        glm::normalize(glm::cross(out_.facets_.back().normal, glm::normalize(to - from)));
    const double offset = (glm::dot(inward, from) + glm::dot(inward, to)) / 2;
    out_.sides_.push_back({inward, offset, edge_of_[s], across});
  }

  // Counter-clockwise around a vertex: from the side that leaves it, over the facet on the left, to
  // the side that arrives, whose opposite leaves the vertex.
  void add_fans() {
    std::vector<Index> opposite(out_.sides_.size()),
        leaving(out_.vertices_.size(), HalfEdges::kNone);
    for (Index s = 0; s < outlines_.side_count(); ++s) {
      opposite[side_of_[s]] = side_of_[outlines_.opposite[s]];
    }
    for (Index s = 0; s < start_.size(); ++s) leaving[start_[s]] = s;
    out_.fan_first_.reserve(out_.vertices_.size() + 1);
    out_.fan_edges_.reserve(out_.sides_.size());
    for (const Index begin : leaving) {
      out_.fan_first_.push_back(static_cast<Index>(out_.fan_edges_.size()));
      Index side = begin;
      do {
        out_.fan_edges_.push_back(out_.sides_[side].edge);
        const Edge& edge = out_.edges_[out_.sides_[side].edge];
        const Facet& facet = out_.facets_[edge.v0 == start_[side] ? edge.left : edge.right];
        const bool is_first = side == facet.first_side;
        side = opposite[is_first ? side + facet.side_count - 1 : side - 1];
      } while (side != begin);
    }
    out_.fan_first_.push_back(static_cast<Index>(out_.fan_edges_.size()));
  }

  // About the middle of the bounding box: radius at most 1.74 times that of the smallest sphere,
  // and the smallest for anything with a centre of symmetry.
  void add_sphere() {
    Vec3 low = out_.vertices_[0], high = low;
    for (const Vec3& vertex : out_.vertices_) {
      low = glm::min(low, vertex);
      high = glm::max(high, vertex);
    }
    out_.centre_ = low + (high - low) / 2.0;
    for (const Vec3& vertex : out_.vertices_) {
      out_.radius_ = std::max(out_.radius_, glm::distance(vertex, out_.centre_));
    }
  }

  ConvexMesh& out_;
  const HalfEdges& mesh_;
  const FacetOutlines& outlines_;
  std::vector<Index> number_of_;          // of each region
  std::vector<Index> side_of_, edge_of_;  // of each side of the outlines
  std::vector<Index> vertex_of_;          // of each welded point
  std::vector<Index> soup_vertex_;        // of each vertex
  std::vector<Index> start_;              // of each side, its first vertex
  std::vector<Vec3> corners_;
};

bool ConvexMesh::Builder::fill(ConvexMesh& out, const HalfEdges& mesh,
                               const std::vector<Index>& region_of, Index count,
                               MeshFaults& faults) {
  const FacetOutlines outlines = facet_outlines(mesh, region_of, count, faults);
  if (!faults.empty()) return false;
  Builder builder(out, mesh, outlines);
  builder.build();
  check_convexity(out, builder.soup_vertex(), mesh.naming, mesh.error, faults);
  return true;
}

bool ConvexMesh::Builder::fill_from_hull(ConvexMesh& out, const HalfEdges& mesh,
                                         const std::vector<FaceShape>& shapes) {
  const GridHull hull = grid_hull(mesh.points, mesh.error);
  if (hull.soup.faces.empty() || hull.depth > kDeepest * mesh.error) return false;
  MeshFaults hull_faults;
  const HalfEdges hull_mesh = link_half_edges(hull.soup, hull_faults);
  if (!hull_faults.empty()) return false;
  const std::vector<FaceShape> hull_shapes = shapes_of(hull_mesh);
  // A surface that winds round twice has the corners of its hull and convex edges: volumes differ.
  const Bulk is = bulk_of(mesh, shapes), could_be = bulk_of(hull_mesh, hull_shapes);
  if (std::abs(could_be.volume - is.volume) > kDeepest * mesh.error * is.area) return false;
  Index count = 0;
  const std::vector<Index> merged = coplanar_regions(hull_mesh, hull_shapes, count);
  if (fill(out, hull_mesh, merged, count, hull_faults) && hull_faults.empty()) return true;
  MeshFaults last_faults;
  const std::vector<Index> triangles = single_regions(hull_mesh, hull_shapes, count);
  return fill(out, hull_mesh, triangles, count, last_faults) && last_faults.empty();
}

ConvexMesh::ConvexMesh(const PolygonSoup& soup) {
  MeshFaults faults;
  const HalfEdges mesh = link_half_edges(soup, faults);
  const std::vector<FaceShape> shapes = shapes_of(mesh);
  check_solid(mesh, shapes, faults);
  faults.throw_if_any();
  Index count = 0;
  const std::vector<Index> merged = coplanar_regions(mesh, shapes, count);
  if (count == 0) faults.add("flat", [] { return "expected a solid, found lines only"; });
  faults.throw_if_any();
  if (!Builder::fill(*this, mesh, merged, count, faults) &&
      Builder::fill_from_hull(*this, mesh, shapes)) {
    return;
  }
  faults.throw_if_any();
}

}  // namespace palpate::stimuli
