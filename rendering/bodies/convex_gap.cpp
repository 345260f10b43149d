#include "rendering/bodies/convex_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <optional>

#include "rendering/separation.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/vec.h"

namespace palpate::rendering {
namespace {

// The point of a simplex nearest to the origin, for GJK. Internal to convex_gap.cpp.

/// Corners of the difference of two parts, with the points of both parts that give them.
struct GapSimplex {
  struct Corner {
    Vec3 point;  ///< on_b - on_a
    Vec3 on_a, on_b;
    std::uint32_t vertex_a = 0, vertex_b = 0;
  };
  std::array<Corner, 4> corners;
  std::array<double, 4> weights{};
  std::size_t count = 0;

  Vec3 nearest() const {
    Vec3 sum(0);
    for (std::size_t i = 0; i < count; ++i) sum += weights[i] * corners[i].point;
    return sum;
  }
};

void keep(GapSimplex& simplex, std::initializer_list<std::size_t> which,
          std::initializer_list<double> weights) {
  const GapSimplex before = simplex;
  simplex.count = 0;
  const double* weight = weights.begin();
  for (const std::size_t i : which) {
    simplex.corners[simplex.count] = before.corners[i];
    simplex.weights[simplex.count++] = *weight++;
  }
}

void nearest_of_segment(GapSimplex& s) {
  const Vec3 &a = s.corners[0].point, &b = s.corners[1].point;
  const Vec3 ab = b - a;
  const double along = -glm::dot(a, ab), length2 = glm::dot(ab, ab);
  if (along <= 0) return keep(s, {0}, {1});
  if (along >= length2) return keep(s, {1}, {1});
  const double t = along / length2;
  s.weights = {1 - t, t, 0, 0};
}

/// Ericson, Real-Time Collision Detection 2005, 5.1.5, for the origin.
void nearest_of_triangle(GapSimplex& s) {
  const Vec3 &a = s.corners[0].point, &b = s.corners[1].point, &c = s.corners[2].point;
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = -glm::dot(ab, a), d2 = -glm::dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return keep(s, {0}, {1});
  const double d3 = -glm::dot(ab, b), d4 = -glm::dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return keep(s, {1}, {1});
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return keep(s, {0, 1}, {1 - d1 / (d1 - d3), d1 / (d1 - d3)});
  const double d5 = -glm::dot(ab, c), d6 = -glm::dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return keep(s, {2}, {1});
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return keep(s, {0, 2}, {1 - d2 / (d2 - d6), d2 / (d2 - d6)});
  const double va = d3 * d6 - d5 * d4;
  const double e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0) return keep(s, {1, 2}, {1 - e / (e + f), e / (e + f)});
  const double sum = va + vb + vc;
  s.weights = {va / sum, vb / sum, vc / sum, 0};
}

bool nearest_of_tetrahedron(GapSimplex& s) {
  constexpr std::size_t kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  GapSimplex best;
  double least = HUGE_VAL;
  for (const auto& face : kFaces) {
    const Vec3& a = s.corners[face[0]].point;
    const Vec3 normal = glm::cross(s.corners[face[1]].point - a, s.corners[face[2]].point - a);
    const double other = glm::dot(normal, s.corners[face[3]].point - a);
    const double origin = -glm::dot(normal, a);
    if (origin * other > 0) continue;  // the origin is on the inner side
    GapSimplex one;
    one.count = 3;
    for (std::size_t i = 0; i < 3; ++i) one.corners[i] = s.corners[face[i]];
    nearest_of_triangle(one);
    const Vec3 at = one.nearest();
    if (glm::dot(at, at) >= least) continue;
    least = glm::dot(at, at);
    best = one;
  }
  if (!(least < HUGE_VAL)) return false;
  s = best;
  return true;
}

/// Keeps the corners that hold the nearest point, with their weights. False: the origin is inside.
bool reduce_to_nearest(GapSimplex& simplex) {
  switch (simplex.count) {
    case 1:
      simplex.weights = {1, 0, 0, 0};
      return true;
    case 2:
      nearest_of_segment(simplex);
      return true;
    case 3:
      nearest_of_triangle(simplex);
      return true;
    default:
      return nearest_of_tetrahedron(simplex);
  }
}

/// The slab of two parts along a direction, m, with the corners that bound it.
struct Slab {
  double distance = 0;
  Vec3 corner_a, corner_b;  // world
};

std::uint32_t support_of(const ConvexPlace& part, const Vec3& direction, std::uint32_t start) {
  return stimuli::support_vertex(*part.mesh, part.local_vector(direction), start);
}

/// \param normal  unit
Slab slab_along(const ConvexPlace& a, const ConvexPlace& b, const Vec3& normal, GapMemory& memory) {
  memory.support_a = support_of(a, normal, memory.support_a);
  memory.support_b = support_of(b, -normal, memory.support_b);
  Slab slab;
  slab.corner_a = a.world_point(a.mesh->vertices()[memory.support_a]);
  slab.corner_b = b.world_point(b.mesh->vertices()[memory.support_b]);
  slab.distance = glm::dot(normal, slab.corner_b - slab.corner_a);
  return slab;
}

/// Corners of the difference of the two shrunk parts.
class Corners {
 public:
  Corners(const ConvexPlace& a, const ConvexPlace& b, double scale)
      : a_(a),
        b_(b),
        inside_a_(a.world_point(a.inside)),
        inside_b_(b.world_point(b.inside)),
        scale_(scale) {}
  Vec3 between() const { return inside_b_ - inside_a_; }
  /// A corner of the difference of the whole parts.
  Vec3 whole(std::uint32_t vertex_a, std::uint32_t vertex_b) const {
    return on_b(vertex_b) - on_a(vertex_a);
  }
  GapSimplex::Corner of(std::uint32_t vertex_a, std::uint32_t vertex_b) const {
    GapSimplex::Corner corner;
    corner.on_a = inside_a_ + scale_ * (on_a(vertex_a) - inside_a_);
    corner.on_b = inside_b_ + scale_ * (on_b(vertex_b) - inside_b_);
    corner.point = corner.on_b - corner.on_a;
    corner.vertex_a = vertex_a;
    corner.vertex_b = vertex_b;
    return corner;
  }

 private:
  Vec3 on_a(std::uint32_t vertex) const { return a_.world_point(a_.mesh->vertices()[vertex]); }
  Vec3 on_b(std::uint32_t vertex) const { return b_.world_point(b_.mesh->vertices()[vertex]); }

  const ConvexPlace &a_, &b_;
  Vec3 inside_a_, inside_b_;
  double scale_;
};

/// The last nearest simplex at its present place. Empty: there is none, or it holds the origin.
GapSimplex simplex_of(const GapMemory& memory, const Corners& corners, double least) {
  GapSimplex simplex;
  for (; simplex.count < memory.nearest_count; ++simplex.count) {
    const auto& [vertex_a, vertex_b] = memory.nearest[simplex.count];
    simplex.corners[simplex.count] = corners.of(vertex_a, vertex_b);
  }
  if (simplex.count == 0 || !reduce_to_nearest(simplex)) return {};
  const Vec3 at = simplex.nearest();
  return glm::dot(at, at) > least * least ? simplex : GapSimplex{};
}

void remember(const GapSimplex& simplex, GapMemory& memory) {
  memory.nearest_count = static_cast<std::uint32_t>(std::min<std::size_t>(simplex.count, 3));
  for (std::uint32_t i = 0; i < memory.nearest_count; ++i)
    memory.nearest[i] = {simplex.corners[i].vertex_a, simplex.corners[i].vertex_b};
}

/// GJK of both parts, scaled. Empty: they still overlap.
/// \param enough  m; a direction along which the whole parts are farther apart ends the search
std::optional<GapSimplex> nearest_simplex(const ConvexPlace& a, const ConvexPlace& b, double scale,
                                          double size, double enough, GapMemory& memory) {
  constexpr int kMostRounds = 64;
  constexpr double kConverged = 1e-12, kInside = 1e-12;
  const Corners corners(a, b, scale);
  GapSimplex simplex = simplex_of(memory, corners, 1e-6 * size);
  Vec3 v = simplex.count > 0                            ? simplex.nearest()
           : glm::dot(memory.normal, memory.normal) > 0 ? memory.normal * size
                                                        : corners.between();
  if (!(glm::dot(v, v) > 0)) v = Vec3(size, 0, 0);
  for (int round = 0; round < kMostRounds; ++round) {
    memory.support_a = support_of(a, v, memory.support_a);
    memory.support_b = support_of(b, -v, memory.support_b);
    const GapSimplex::Corner corner = corners.of(memory.support_a, memory.support_b);
    const double v2 = glm::dot(v, v);
    const double along = glm::dot(v, corners.whole(memory.support_a, memory.support_b));
    if (along > 0 && along * along > (1 + 1e-9) * enough * enough * v2) {
      simplex.count = 1;
      simplex.corners[0] = {v, corner.on_a, corner.on_b};
      simplex.weights = {1, 0, 0, 0};
      return simplex;
    }
    if (simplex.count > 0) {
      if (v2 - glm::dot(v, corner.point) <= kConverged * v2) break;
      const bool again =
          std::any_of(simplex.corners.begin(),
                      simplex.corners.begin() + static_cast<std::ptrdiff_t>(simplex.count),
                      [&](const auto& known) { return known.point == corner.point; });
      if (again) break;
    }
    const GapSimplex before = simplex;
    simplex.corners[simplex.count++] = corner;
    if (!reduce_to_nearest(simplex)) return std::nullopt;
    const Vec3 nearer = simplex.nearest();
    const double distance2 = glm::dot(nearer, nearer);
    if (!(distance2 > kInside * kInside * size * size)) return std::nullopt;
    if (before.count > 0 && distance2 >= v2) {  // rounding
      simplex = before;
      break;
    }
    v = nearer;
  }
  remember(simplex, memory);
  return simplex;
}

/// The point of the whole part for a point of the shrunk part.
Vec3 made_whole(const ConvexPlace& part, const Vec3& point, double scale) {
  const Vec3 inside = part.world_point(part.inside);
  return inside + (point - inside) / scale;
}

struct BestFacet {
  std::uint32_t index = 0;
  double cosine = -2;
};

/// The facet at a vertex that faces a direction most.
/// \param direction  mesh frame, unit
BestFacet facet_at(const stimuli::ConvexMesh& mesh, std::uint32_t vertex, const Vec3& direction) {
  BestFacet best;
  for (std::uint32_t k = mesh.fan_first()[vertex]; k < mesh.fan_first()[vertex + 1]; ++k) {
    const stimuli::Edge& edge = mesh.edges()[mesh.fan_edges()[k]];
    for (const std::uint32_t f : {edge.left, edge.right}) {
      const double cosine = glm::dot(mesh.facets()[f].normal, direction);
      if (cosine > best.cosine) best = {f, cosine};
    }
  }
  return best;
}

/// The facet's corners, world frame.
void corners_of(const ConvexPlace& part, std::uint32_t f, std::vector<Vec3>& out) {
  out.clear();
  const stimuli::Facet& facet = part.mesh->facets()[f];
  for (std::uint32_t k = 0; k < facet.side_count; ++k) {
    const stimuli::Edge& edge = part.mesh->edges()[part.mesh->sides()[facet.first_side + k].edge];
    out.push_back(part.world_point(edge.left == f ? edge.from : edge.to));
  }
}

/// Clips room.polygon to the piece over a facet.
void clip_to(const ConvexPlace& part, const stimuli::Facet& facet, ClipRoom& room) {
  for (std::uint32_t k = 0; k < facet.side_count; ++k) {
    const stimuli::Side& side = part.mesh->sides()[facet.first_side + k];
    const Vec3 inward = part.axes * side.inward;
    const double offset = side.offset + glm::dot(inward, part.position);
    const auto height = [&](const Vec3& p) { return glm::dot(inward, p) - offset; };
    if (std::all_of(room.polygon.begin(), room.polygon.end(),
                    [&](const Vec3& p) { return height(p) >= 0; }))
      continue;
    room.next.clear();
    for (std::size_t i = 0; i < room.polygon.size(); ++i) {
      const Vec3 &p = room.polygon[i], &q = room.polygon[(i + 1) % room.polygon.size()];
      const double at_p = height(p), at_q = height(q);
      if (at_p >= 0) room.next.push_back(p);
      if ((at_p >= 0) != (at_q >= 0)) room.next.push_back(p + at_p / (at_p - at_q) * (q - p));
    }
    std::swap(room.polygon, room.next);
    if (room.polygon.empty()) return;
  }
}

/// Keeps the points that support like all of them: the nearest, and the farthest to four sides.
void choose_points(const ClipRoom& room, const Vec3& normal, Manifold& out) {
  const std::vector<ManifoldPoint>& all = room.points;
  if (all.size() <= 4) {
    for (const ManifoldPoint& point : all) out.add(point);
    return;
  }
  const Vec3 least = std::abs(normal.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 u = glm::normalize(glm::cross(normal, least)), v = glm::cross(normal, u);
  // Rotated by an angle that is no symmetry of a regular polygon.
  const Vec3 first = 0.9 * u + 0.4359 * v, second = glm::cross(normal, first);
  const auto nearest = std::min_element(all.begin(), all.end(),
                                        [](const auto& a, const auto& b) { return a.gap < b.gap; });
  std::array<const ManifoldPoint*, 5> chosen{&*nearest};
  std::size_t count = 1;
  for (const Vec3& side : {first, -first, second, -second}) {
    const auto farthest =
        std::max_element(all.begin(), all.end(), [&](const auto& a, const auto& b) {
          return glm::dot(a.place, side) < glm::dot(b.place, side);
        });
    if (std::find(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(count),
                  &*farthest) == chosen.begin() + static_cast<std::ptrdiff_t>(count))
      chosen[count++] = &*farthest;
  }
  for (std::size_t i = 0; i < count; ++i) out.add(*chosen[i]);
}

}  // namespace

Gap gap_between(const ConvexPlace& a, const ConvexPlace& b, double enough, GapMemory& memory) {
  constexpr double kScales[] = {1 - 1e-4, 1 - 1e-2, 0.8, 0.3, 0.01};
  const double size = a.mesh->radius() + b.mesh->radius();
  Gap gap;
  if (glm::dot(memory.normal, memory.normal) > 0) {
    const Slab known = slab_along(a, b, memory.normal, memory);
    if (known.distance >= enough) {
      gap.normal = memory.normal;
      gap.distance = known.distance;
      gap.on_a = known.corner_a;
      gap.on_b = known.corner_b;
      return gap;
    }
  }
  Vec3 between = b.world_point(b.inside) - a.world_point(a.inside);
  if (!(glm::dot(between, between) > 0)) between = Vec3(0, 0, 1);
  gap.normal = glm::normalize(between);
  const std::uint32_t support_a = memory.support_a, support_b = memory.support_b;
  for (const double scale : kScales) {
    const std::optional<GapSimplex> nearest = nearest_simplex(a, b, scale, size, enough, memory);
    if (!nearest) {
      // The search ended with directions unrelated to the gap.
      memory.support_a = support_a;
      memory.support_b = support_b;
      continue;
    }
    gap.normal = glm::normalize(nearest->nearest());
    for (std::size_t i = 0; i < nearest->count; ++i) {
      gap.on_a += nearest->weights[i] * nearest->corners[i].on_a;
      gap.on_b += nearest->weights[i] * nearest->corners[i].on_b;
    }
    gap.on_a = made_whole(a, gap.on_a, scale);
    gap.on_b = made_whole(b, gap.on_b, scale);
    break;
  }
  memory.normal = gap.normal;
  gap.distance = slab_along(a, b, gap.normal, memory).distance;
  return gap;
}

void find_manifold(const ConvexPlace& a, const ConvexPlace& b, const Gap& gap, double reach,
                   const GapMemory& memory, ClipRoom& room, Manifold& out) {
  constexpr double kAligned = 1 - 1e-10;  // cosine; 1.4e-5 rad
  out.clear();
  out.normal = gap.normal;
  const BestFacet on_a = facet_at(*a.mesh, memory.support_a, a.local_vector(gap.normal));
  const BestFacet on_b = facet_at(*b.mesh, memory.support_b, b.local_vector(-gap.normal));
  if (std::max(on_a.cosine, on_b.cosine) >= kAligned) {
    const bool first = on_a.cosine >= on_b.cosine;
    const ConvexPlace &flat = first ? a : b, &other = first ? b : a;
    const stimuli::Facet& facet = flat.mesh->facets()[first ? on_a.index : on_b.index];
    const Vec3 normal = flat.axes * facet.normal;
    const double offset = facet.offset + glm::dot(normal, flat.position);
    const std::uint32_t vertex = first ? memory.support_b : memory.support_a;
    const BestFacet across = facet_at(*other.mesh, vertex, other.local_vector(-normal));
    corners_of(other, across.index, room.polygon);
    clip_to(flat, facet, room);
    room.points.clear();
    for (const Vec3& p : room.polygon) {
      const double distance = glm::dot(normal, p) - offset;
      if (distance <= reach) room.points.push_back({p - 0.5 * distance * normal, distance});
    }
    out.normal = first ? normal : -normal;
    choose_points(room, normal, out);
    if (!out.points().empty()) return;
    out.normal = gap.normal;
  }
  if (gap.distance <= reach) out.add({0.5 * (gap.on_a + gap.on_b), gap.distance});
}

}  // namespace palpate::rendering
