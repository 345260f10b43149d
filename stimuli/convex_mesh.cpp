#include "stimuli/convex_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/coplanar.h"
#include "stimuli/face_triangles.h"
#include "stimuli/facet_outlines.h"
#include "stimuli/grid_hull.h"
#include "stimuli/half_edges.h"
#include "stimuli/inset.h"
#include "stimuli/mesh_names.h"
#include "stimuli/plane_deviation.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

// In errors: how far a corner may lie below the hull of all corners; a corner may stand as far in
// front of a facet.
constexpr double kDeepest = 16 * kCoplanar;

struct Bulk {
  double volume = 0, area = 0;  // m^3, negative where it is inside out; m^2
};

Bulk bulk_within(const HalfEdges& mesh, const std::vector<FaceShape>& shapes) {
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
  const auto [volume, area] = bulk_within(mesh, shapes);
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

/// m^3, no more than that of the hull of all points: of the outermost in some directions. Far
/// quicker than the whole hull.
double least_hull_volume(const std::vector<Vec3>& points) {
  constexpr int kDirections = 64;
  constexpr double kGolden = 2.399963229728653;  // rad
  std::vector<Vec3> outermost;
  for (int i = 0; i < kDirections; ++i) {
    const double z = (2 * i + 1.0) / kDirections - 1, r = std::sqrt(1 - z * z);
    const Vec3 way(r * std::cos(kGolden * i), r * std::sin(kGolden * i), z);
    outermost.push_back(*std::max_element(
        points.begin(), points.end(),
        [&](const Vec3& a, const Vec3& b) { return glm::dot(way, a) < glm::dot(way, b); }));
  }
  const PolygonSoup hull = grid_hull(outermost, 0).soup;
  double volume = 0;
  for (const std::vector<Index>& face : hull.faces) {
    const Vec3 a = hull.vertices[face[0]] - points[0], b = hull.vertices[face[1]] - points[0],
               c = hull.vertices[face[2]] - points[0];
    volume += glm::dot(a, glm::cross(b, c)) / 6;
  }
  return volume;
}

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

// Checks that a mesh is convex. The last step of building a ConvexMesh.
void check_convexity(const ConvexMesh& mesh, const std::vector<Index>& soup_vertex,
                     const MeshNaming& naming, double error, MeshFaults& faults) {
  Checker checker(mesh, soup_vertex, naming, error, faults);
  for (Index f = 0; f < mesh.facets().size(); ++f) checker.check_facet(f);
  for (Index e = 0; e < mesh.edges().size(); ++e) checker.check_edge(e);
  for (Index v = 0; v < mesh.vertices().size(); ++v) checker.check_vertex(v);
}

// The largest ball (c, r): the linear program "maximise r with n_i.c + r <= d_i for all facets", by
// the dual simplex method (Lemke 1954). Its basis is four planes that a ball touches on all sides;
// each round takes in the plane that is violated most and drops the one that must leave.
class BallProgram {
 public:
  explicit BallProgram(const ConvexMesh& mesh) : mesh_(mesh) {
    // Start from a regular tetrahedron far outside; all its planes must leave the basis.
    const double a = 1 / std::sqrt(3.0), far = 10 * mesh.size();
    basis_ = {Row{{a, a, a, 1}, far}, Row{{a, -a, -a, 1}, far}, Row{{-a, a, -a, 1}, far},
              Row{{-a, -a, a, 1}, far}};
    weight_.fill(0.25);
  }

  Ball solve() {
    constexpr int kMostRounds = 100000, kBlandFrom = 1000;
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * mesh_.size();
    for (int round = 0; round < kMostRounds; ++round) {
      Matrix rows{};
      std::array<double, 4> offsets{};
      for (int i = 0; i < 4; ++i) {
        rows[i] = basis_[i].a;
        offsets[i] = basis_[i].d;
      }
      const std::array<double, 4> x = solved(rows, offsets);
      const Vec3 centre(x[0], x[1], x[2]);
      const std::size_t enters = violated(centre, x[3], rounding, round >= kBlandFrom);
      if (enters == kNone || !exchange(row_of(enters)))
        return {mesh_.centre() + centre, clearance(centre)};
    }
    return {mesh_.centre(), clearance(Vec3(0))};
  }

 private:
  using Matrix = std::array<std::array<double, 4>, 4>;
  struct Row {
    std::array<double, 4> a;  // unit outward normal, 1
    double d = 0;             // m, from the mesh's centre
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  Row row_of(std::size_t facet) const {
    const Facet& f = mesh_.facets()[facet];
    return {{f.normal.x, f.normal.y, f.normal.z, 1}, f.offset - glm::dot(f.normal, mesh_.centre())};
  }

  double room(const Facet& f, const Vec3& centre) const {
    return f.offset - glm::dot(f.normal, mesh_.centre() + centre);
  }

  double clearance(const Vec3& centre) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Facet& f : mesh_.facets()) least = std::min(least, room(f, centre));
    return least;
  }

  /// The facet that the ball violates most, or the first one (Bland 1977: no basis then repeats).
  std::size_t violated(const Vec3& centre, double radius, double rounding, bool first) const {
    std::size_t worst = kNone;
    double least = -rounding;
    for (std::size_t i = 0; i < mesh_.facets().size(); ++i) {
      const double left = room(mesh_.facets()[i], centre) - radius;
      if (left >= least) continue;
      least = left;
      worst = i;
      if (first) break;
    }
    return worst;
  }

  /// \return false: no plane may leave the basis, within rounding
  bool exchange(const Row& enters) {
    Matrix columns{};
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) columns[r][c] = basis_[c].a[r];
    }
    const std::array<double, 4> share = solved(columns, enters.a);
    int goes = -1;
    double step = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 4; ++i) {
      if (share[i] <= 1e-12) continue;
      const double ratio = std::max(0.0, weight_[i]) / share[i];
      if (goes >= 0 && (ratio > step || (ratio == step && share[i] <= share[goes]))) continue;
      step = ratio;
      goes = i;
    }
    if (goes < 0) return false;
    for (int i = 0; i < 4; ++i) weight_[i] -= step * share[i];
    weight_[goes] = step;
    basis_[goes] = enters;
    return true;
  }

  /// Gaussian elimination with partial pivoting.
  static std::array<double, 4> solved(Matrix m, std::array<double, 4> b) {
    for (int k = 0; k < 4; ++k) {
      int pivot = k;
      for (int r = k + 1; r < 4; ++r) {
        if (std::abs(m[r][k]) > std::abs(m[pivot][k])) pivot = r;
      }
      std::swap(m[k], m[pivot]);
      std::swap(b[k], b[pivot]);
      for (int r = k + 1; r < 4; ++r) {
        const double factor = m[r][k] / m[k][k];
        for (int c = k; c < 4; ++c) m[r][c] -= factor * m[k][c];
        b[r] -= factor * b[k];
      }
    }
    for (int k = 3; k >= 0; --k) {
      for (int c = k + 1; c < 4; ++c) b[k] -= m[k][c] * b[c];
      b[k] /= m[k][k];
    }
    return b;
  }

  const ConvexMesh& mesh_;
  std::array<Row, 4> basis_;
  std::array<double, 4> weight_{};  // of the basis rows in the objective r
};

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
  // A surface that winds round twice has the corners of its hull and convex edges: volumes differ.
  const Bulk is = bulk_within(mesh, shapes);
  const double most = kDeepest * mesh.error * is.area;
  if (least_hull_volume(mesh.points) - is.volume > 2 * most) return false;
  const GridHull hull = grid_hull(mesh.points, mesh.error);
  if (hull.soup.faces.empty() || hull.depth > kDeepest * mesh.error) return false;
  MeshFaults hull_faults;
  const HalfEdges hull_mesh = link_half_edges(hull.soup, hull_faults);
  if (!hull_faults.empty()) return false;
  const std::vector<FaceShape> hull_shapes = shapes_of(hull_mesh);
  if (std::abs(bulk_within(hull_mesh, hull_shapes).volume - is.volume) > most) return false;
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

Ball largest_inscribed_ball(const ConvexMesh& mesh) { return BallProgram(mesh).solve(); }

PolygonSoup ConvexMesh::polygons() const {
  PolygonSoup soup;
  soup.vertices.assign(vertices_.begin(), vertices_.end());
  for (std::uint32_t f = 0; f < facets_.size(); ++f) {
    auto& face = soup.faces.emplace_back();
    for (std::uint32_t k = 0; k < facets_[f].side_count; ++k) {
      const Edge& edge = edges_[sides_[facets_[f].first_side + k].edge];
      face.push_back(edge.left == f ? edge.v0 : edge.v1);
    }
  }
  return soup;
}

}  // namespace palpate::stimuli
