#include "rendering/facet_walk.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace palpate {
namespace {

// Ho, Basdogan & Srinivasan 2000, 4(b). Departs: the paper's rules are steps between adjacent
// facets of the Minkowski sum M of the object and the mirrored probe, so one loop covers them all.
//
// A step over a violated side strictly lowers the depth as long as the depth is not negative, so
// the loop ends; a negative depth is a plane between probe and object: the probe has left.

using Kind = MinkowskiFacet::Kind;

constexpr std::uint32_t kNone = ~0u;
constexpr std::uint32_t kScanSides = 12;  // more sides than this are searched by halving
constexpr double kParallel = 1e-9;        // |e x d| / (|e| |d|) below this: no contact edge
constexpr double kDepthRounding = 1e-15;  // of the size; a smaller gain is rounding, not a step

std::uint32_t corner(const ConvexMesh& mesh, std::uint32_t facet, const Side& side) {
  const Edge& edge = mesh.edges()[side.edge];
  return edge.left == facet ? edge.v0 : edge.v1;
}

bool outside(const Side& side, const Vec3& p) { return glm::dot(side.inward, p) < side.offset; }

/// What p, a point of the plane of a polygon with many sides, lies over: halving over the fan of
/// triangles at corner 0, so that a cap of a thousand sides costs ten comparisons.
Neighbour beyond_many(const ConvexMesh& mesh, std::uint32_t index, const Vec3& p) {
  const Facet& facet = mesh.facets()[index];
  const Side* sides = &mesh.sides()[facet.first_side];
  const std::uint32_t count = facet.side_count;
  const auto beyond = [&](std::uint32_t i) { return Neighbour{sides[i].edge, sides[i].across}; };
  if (outside(sides[0], p)) return beyond(0);
  if (outside(sides[count - 1], p)) return beyond(count - 1);
  const Vec3 apex = mesh.vertices()[corner(mesh, index, sides[0])];
  const Vec3 turn = glm::cross(facet.normal, p - apex);  // in-plane, a quarter turn ahead of p
  std::uint32_t low = 1, high = count - 1;  // p lies between the rays to corner low and corner high
  while (high - low > 1) {
    const std::uint32_t middle = (low + high) / 2;
    const Vec3 ray = mesh.vertices()[corner(mesh, index, sides[middle])] - apex;
    (glm::dot(ray, turn) <= 0 ? low : high) = middle;
  }
  return outside(sides[low], p) ? beyond(low) : Neighbour{kNone, kNone};
}

/// What p, a point of the facet's plane, lies over when it is past a side; edge kNone when it is
/// inside.
Neighbour beyond_side(const ConvexMesh& mesh, std::uint32_t index, const Vec3& p) {
  const Facet& facet = mesh.facets()[index];
  if (facet.side_count > kScanSides) return beyond_many(mesh, index, p);
  Neighbour beyond{kNone, kNone};
  double worst = 0;
  if (facet.side_count == 3) {
    // Past a side is above the plane of the facet there, which a step reads next anyway.
    for (const Neighbour& next : facet.triangle) {
      const Facet& across = mesh.facets()[next.across];
      const double height = glm::dot(across.normal, p) - across.offset;
      if (height > worst) {
        worst = height;
        beyond = next;
      }
    }
    return beyond;
  }
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const Side& side = mesh.sides()[i];
    const double distance = side.offset - glm::dot(side.inward, p);
    if (distance > worst) {
      worst = distance;
      beyond = {side.edge, side.across};
    }
  }
  return beyond;
}

/// One facet of M measured against the probe.
struct Measured {
  bool edge = false;        ///< else a face
  bool left_ahead = false;  ///< edge only
  std::uint32_t index = 0;
  Vec3 normal;
  double depth = 0;
  double place = 0;       ///< along the probe, 0 tip to 1 tail
  double along_edge = 0;  ///< edge only: 0 at v0 to 1 at v1
};

template <bool kSegment>
Measured measure_face(const ConvexMesh& mesh, std::uint32_t index, const Vec3& tip, const Vec3& d) {
  const Facet& facet = mesh.facets()[index];
  Measured m;
  m.index = index;
  m.normal = facet.normal;
  const double height = facet.offset - glm::dot(facet.normal, tip);
  if constexpr (kSegment) {
    const double slope = glm::dot(facet.normal, d);
    m.place = slope >= 0 ? 0.0 : 1.0;
    m.depth = slope >= 0 ? height : height - slope;
  } else {
    m.depth = height;
  }
  return m;
}

struct Slopes {
  double left, right;  ///< dot(normal, d) of the edge's two faces
  bool silhouette() const { return (left >= 0) != (right >= 0); }
};

Slopes slopes_at(const ConvexMesh& mesh, const Edge& edge, const Vec3& d) {
  return {glm::dot(mesh.facets()[edge.left].normal, d),
          glm::dot(mesh.facets()[edge.right].normal, d)};
}

/// False where the edge and the probe are parallel: then it is no contact edge.
bool measure_edge(const ConvexMesh& mesh, std::uint32_t index, bool left_ahead, const Vec3& tip,
                  const Vec3& d, Measured& m) {
  const Edge& edge = mesh.edges()[index];
  const Vec3& v0 = mesh.vertices()[edge.v0];
  const Vec3 e = mesh.vertices()[edge.v1] - v0;
  const Vec3 c = glm::cross(e, d);
  const double c2 = glm::dot(c, c);
  if (c2 <= kParallel * kParallel * glm::dot(e, e) * glm::dot(d, d)) return false;
  const double inverse = 1 / c2;
  const double scale = std::copysign(inverse, left_ahead - 0.5) * std::sqrt(c2);
  const Vec3 w = tip - v0;
  m.edge = true;
  m.left_ahead = left_ahead;
  m.index = index;
  m.normal = scale * c;  // outward: the face ahead leans to the tail, the other to the tip
  m.depth = -glm::dot(m.normal, w);
  // w + depth n + place d = along_edge e, crossed with e and with d
  m.place = glm::dot(glm::cross(w, e), c) * inverse;
  m.along_edge = glm::dot(glm::cross(w, d), c) * inverse;
  return true;
}

/// A silhouette edge and its face ahead.
struct SilhouetteEdge {
  std::uint32_t edge = kNone;
  bool left_ahead = false;
};

/// The other silhouette edge at one end of `from`, which is one; the faces around a vertex change
/// sides exactly twice. Turns about the vertex counter-clockwise, from face to face, until they do.
/// Edge kNone when rounding hides the second one, or where not all faces are triangles.
SilhouetteEdge turn_about(const ConvexMesh& mesh, std::uint32_t from, bool about_v1,
                          bool left_ahead, const Vec3& d) {
  // Out of the face on the left the next side starts at v1, out of the one on the right at v0.
  const bool ahead = about_v1 == left_ahead;
  std::uint32_t edge = from;
  const Facet* face = &mesh.facets()[about_v1 ? mesh.edges()[from].left : mesh.edges()[from].right];
  while (face->side_count == 3) {
    const auto& sides = face->triangle;
    const Neighbour& next = sides[edge == sides[0].edge ? 1 : edge == sides[1].edge ? 2 : 0];
    edge = next.edge;
    if (edge == from) return {};
    const Facet* across = &mesh.facets()[next.across];
    if ((glm::dot(across->normal, d) >= 0) != ahead) {
      const bool face_is_left = face == &mesh.facets()[mesh.edges()[edge].left];
      return {edge, face_is_left == ahead};
    }
    face = across;
  }
  return {};
}

/// The same by looking through the vertex' fan.
SilhouetteEdge search_fan(const ConvexMesh& mesh, std::uint32_t from, bool about_v1,
                          const Vec3& d) {
  const std::uint32_t vertex = about_v1 ? mesh.edges()[from].v1 : mesh.edges()[from].v0;
  for (std::uint32_t i = mesh.fan_first()[vertex]; i < mesh.fan_first()[vertex + 1]; ++i) {
    const std::uint32_t candidate = mesh.fan_edges()[i];
    const Slopes slopes = slopes_at(mesh, mesh.edges()[candidate], d);
    if (candidate != from && slopes.silhouette()) return {candidate, slopes.left >= 0};
  }
  return {};
}

/// From a face over one of its sides: to the edge where it is a silhouette edge, else to the next
/// face.
template <bool kSegment>
Measured step_from_face(const ConvexMesh& mesh, std::uint32_t from, const Neighbour& side,
                        const Vec3& tip, const Vec3& d) {
  if constexpr (kSegment) {
    const bool here = glm::dot(mesh.facets()[from].normal, d) >= 0;
    const bool there = glm::dot(mesh.facets()[side.across].normal, d) >= 0;
    if (here != there) {
      const bool left_ahead = (mesh.edges()[side.edge].left == from) == here;
      Measured next;
      if (measure_edge(mesh, side.edge, left_ahead, tip, d, next)) return next;
    }
  }
  return measure_face<kSegment>(mesh, side.across, tip, d);
}

/// From an edge past an end of the probe (to the face ahead or behind) or past an end of the edge
/// (to the next silhouette edge). False when the probe is within both.
bool step_from_edge(const ConvexMesh& mesh, const Measured& at, const Vec3& tip, const Vec3& d,
                    Measured& next) {
  const Edge& edge = mesh.edges()[at.index];
  if (at.place < 0 || at.place > 1) {
    const bool to_left = (at.place < 0) == at.left_ahead;
    next = measure_face<true>(mesh, to_left ? edge.left : edge.right, tip, d);
    return true;
  }
  if (at.along_edge < 0 || at.along_edge > 1) {
    const bool about_v1 = at.along_edge > 1;
    SilhouetteEdge other = turn_about(mesh, at.index, about_v1, at.left_ahead, d);
    if (other.edge == kNone) other = search_fan(mesh, at.index, about_v1, d);
    if (other.edge == kNone) return false;
    if (measure_edge(mesh, other.edge, other.left_ahead, tip, d, next)) return true;
    // Parallel to the probe: its two faces meet there with the same depth.
    next = measure_face<true>(mesh, mesh.edges()[other.edge].left, tip, d);
    return true;
  }
  return false;
}

/// The facet that the last tick ended on, measured against where the probe is now.
template <bool kSegment>
Measured resume(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip, const Vec3& d) {
  if constexpr (kSegment) {
    if (start.kind == Kind::edge) {
      const Edge& edge = mesh.edges()[start.index];
      const Slopes slopes = slopes_at(mesh, edge, d);
      Measured m;
      if (slopes.silhouette() && measure_edge(mesh, start.index, slopes.left >= 0, tip, d, m))
        return m;
      // The probe has turned past one of the two faces: there the edge's normal had become that
      // face's normal, so taking that face keeps the force continuous.
      const bool both_ahead = slopes.left >= 0 && slopes.right >= 0;
      const bool left_turned = start.left_ahead != both_ahead;
      return measure_face<true>(mesh, left_turned ? edge.left : edge.right, tip, d);
    }
  }
  return measure_face<kSegment>(mesh, start.index, tip, d);
}

// gcc takes a function that only prefetches for one that does nothing: it must be inlined.
template <bool kEdges>
[[gnu::always_inline]] inline void fetch_beyond(const ConvexMesh& mesh, std::uint32_t facet) {
  for (const Neighbour& next : mesh.facets()[facet].triangle) {
    __builtin_prefetch(&mesh.facets()[next.across]);
    if constexpr (kEdges) __builtin_prefetch(&mesh.edges()[next.edge]);
  }
}

WalkResult to_result(const Measured& at, bool capped) {
  WalkResult result;
  result.normal = at.normal;
  result.depth = at.depth;
  result.place = at.place < 0 ? 0 : at.place > 1 ? 1 : at.place;
  result.capped = capped;
  if (at.depth >= 0) result.facet = {at.edge ? Kind::edge : Kind::face, at.left_ahead, at.index};
  return result;
}

template <bool kSegment>
WalkResult walk(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip, const Vec3& d) {
  const double gain = kDepthRounding * mesh.size();
  Measured at = resume<kSegment>(mesh, start, tip, d);
  bool capped = false;
  int steps = 0;
  while (at.depth >= 0) {
    Measured next;
    if (kSegment && at.edge) {
      if (!step_from_edge(mesh, at, tip, d, next)) break;
    } else {
      const Vec3 end = kSegment && at.place > 0 ? tip + d : tip;
      const Neighbour side = beyond_side(mesh, at.index, end + at.depth * at.normal);
      if (side.edge == kNone) break;
      next = step_from_face<kSegment>(mesh, at.index, side, tip, d);
    }
    if (!(next.depth < at.depth - gain)) break;
    at = next;
    // A path straight across the object visits some sqrt(facets) of them.
    if (++steps > static_cast<int>(mesh.facets().size() + mesh.edges().size())) {
      capped = true;
      break;
    }
  }
  return to_result(at, capped);
}

template <bool kSegment>
WalkResult nearest_facet(const ConvexMesh& mesh, const Vec3& tip, const Vec3& d) {
  Measured nearest = measure_face<kSegment>(mesh, 0, tip, d);
  for (std::uint32_t i = 1; i < mesh.facets().size(); ++i) {
    const Measured m = measure_face<kSegment>(mesh, i, tip, d);
    if (m.depth < nearest.depth) nearest = m;
  }
  if constexpr (kSegment) {
    for (std::uint32_t i = 0; i < mesh.edges().size(); ++i) {
      const Slopes slopes = slopes_at(mesh, mesh.edges()[i], d);
      Measured m;
      if (slopes.silhouette() && measure_edge(mesh, i, slopes.left >= 0, tip, d, m) &&
          m.depth < nearest.depth) {
        nearest = m;
      }
    }
  }
  return to_result(nearest, false);
}

}  // namespace

WalkResult walk_segment(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip,
                        const Vec3& d) {
  return walk<true>(mesh, start, tip, d);
}

WalkResult walk_point(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip) {
  return walk<false>(mesh, start, tip, Vec3(0));
}

void fetch_ahead(const ConvexMesh& mesh, MinkowskiFacet at, int tick) {
  if (at.kind == Kind::face) {
    // A face's neighbours are at hand: the walk has just asked them.
    if (tick > 0) return;
    for (const Neighbour& next : mesh.facets()[at.index].triangle)
      fetch_beyond<false>(mesh, next.across);
    return;
  }
  if (tick == 1) return;  // what was asked for at tick 0 is on its way
  for (const std::uint32_t facet : {mesh.edges()[at.index].left, mesh.edges()[at.index].right}) {
    if (tick == 0) {
      fetch_beyond<true>(mesh, facet);
      continue;
    }
    for (const Neighbour& next : mesh.facets()[facet].triangle) {
      if (next.edge == at.index) continue;
      __builtin_prefetch(&mesh.vertices()[mesh.edges()[next.edge].v0]);
      __builtin_prefetch(&mesh.vertices()[mesh.edges()[next.edge].v1]);
      fetch_beyond<true>(mesh, next.across);
    }
  }
}

WalkResult same_facet_segment(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip,
                              const Vec3& d) {
  return to_result(resume<true>(mesh, start, tip, d), false);
}

WalkResult same_facet_point(const ConvexMesh& mesh, MinkowskiFacet start, const Vec3& tip) {
  return to_result(resume<false>(mesh, start, tip, Vec3(0)), false);
}

WalkResult nearest_facet_segment(const ConvexMesh& mesh, const Vec3& tip, const Vec3& d) {
  return nearest_facet<true>(mesh, tip, d);
}

WalkResult nearest_facet_point(const ConvexMesh& mesh, const Vec3& tip) {
  return nearest_facet<false>(mesh, tip, Vec3(0));
}

}  // namespace palpate
