#include "rendering/surface_patch.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

using PatchKind = SurfacePatch::Kind;

constexpr double kSilhouette = 1e-12;  // of the length; tolerance of a segment along a triangle

/// A side from v0 to v1, with its own triangle on the left.
struct EdgeOf {
  const stimuli::SurfaceTriangle &left, &right;
  Vec3 v0, v1;
  bool folded = false;
};

EdgeOf edge_of(const stimuli::Surface& surface, std::uint32_t side) {
  const stimuli::SurfaceTriangle& left =
      surface.triangles()[stimuli::SurfaceTriangle::triangle_of(side)];
  const std::uint32_t k = stimuli::SurfaceTriangle::side_of(side);
  const stimuli::SurfaceTriangle& right =
      surface.triangles()[stimuli::SurfaceTriangle::triangle_of(left.across[k])];
  return {left, right, surface.vertices()[left.corners[k]],
          surface.vertices()[left.corners[(k + 1) % 3]], left.folded(k)};
}

/// The contact normal of an edge and a segment: perpendicular to both, between the triangles'
/// normals.
Vec3 edge_normal(const EdgeOf& edge, const Vec3& along, double left, double right) {
  constexpr double kAlongEdge = 1e-6;
  // Also right if the segment lies along the edge, unless the edge is sharp.
  const Vec3 between = std::abs(right) * edge.left.normal + std::abs(left) * edge.right.normal;
  const Vec3 e = edge.v1 - edge.v0;
  Vec3 across = left >= 0 ? glm::cross(e, along) : glm::cross(along, e);
  const double size2 = glm::dot(across, across);
  if (size2 > kAlongEdge * kAlongEdge * glm::dot(e, e) * glm::dot(along, along) &&
      (edge.folded || !(glm::dot(across, between) < 0)))
    return across / std::sqrt(size2);
  const double length = glm::length(between);
  if (length > 0) return between / length;
  return glm::normalize(edge.left.normal + edge.right.normal);
}

double to_side(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 side = b - a, to = p - a;
  const double length2 = glm::dot(side, side);
  const double t = length2 > 0 ? std::clamp(glm::dot(to, side) / length2, 0.0, 1.0) : 0.0;
  const Vec3 apart = to - t * side;
  return glm::dot(apart, apart);
}

/// Whether a way goes through a patch, or past its border as near as that. \param time  where it
/// meets the plane, as a fraction
bool goes_through(const PatchPolygon& polygon, const Vec3& normal, const Vec3& from,
                  const Vec3& way, double time, double tolerance, double border) {
  return meets(polygon, from, way, std::min(border, tolerance)) ||
         (border > tolerance && distance_off(polygon, normal, from + time * way) <= border);
}

/// Tests a segment end that moves from `from` to `to` against a triangle.
void sweep_end(const stimuli::Surface& surface, std::uint32_t index, std::uint8_t segment,
               bool tail, const Vec3& from, const Vec3& to, double tolerance, double border,
               PatchHit& first) {
  const stimuli::SurfaceTriangle& t = surface.triangles()[index];
  const Vec3 a = surface.vertices()[t.corners[0]] - from;
  const double start =
      t.shares_plane() ? glm::dot(t.normal, from) - t.offset : -glm::dot(t.normal, a);
  if (start < -tolerance) return;
  const Vec3 way = to - from;
  const double fall = -glm::dot(t.normal, way);
  if (!(fall > 0) || start > fall) return;
  const double time = std::max(0.0, start / fall);
  if (!first.yields_to(time, segment, index)) return;
  PatchPolygon polygon;
  polygon.count = 3;
  for (std::size_t k = 0; k < 3; ++k) polygon.corners[k] = surface.vertices()[t.corners[k]];
  if (!goes_through(polygon, t.normal, from, way, time, tolerance, border)) return;
  first = {{index << 2, segment, tail, PatchKind::face}, time};
}

/// Tests a segment whose ends move linearly against an edge. The two are coplanar at the roots of a
/// quadratic equation in time.
void sweep_edge(const stimuli::Surface& surface, std::uint32_t side, std::uint8_t segment,
                const PosedTool::Segment& from, const PosedTool::Segment& to, double tolerance,
                double slack, PatchHit& first) {
  const EdgeOf edge = edge_of(surface, side);
  const Vec3 e = edge.v1 - edge.v0, r = from.start - edge.v0, way = to.start - from.start,
             turn = to.along - from.along;
  const Vec3 across = glm::cross(e, from.along), change = glm::cross(e, turn);
  const double c0 = glm::dot(across, r), c1 = glm::dot(change, r) + glm::dot(across, way),
               c2 = glm::dot(change, way), end = c0 + c1 + c2;
  const double edge_length = glm::length(e), length = glm::length(from.along);
  const double rounding = tolerance * edge_length * length;
  const double bend = 0.25 * std::abs(c2) + rounding;  // at most, off the line from c0 to the end
  if (std::min(c0, end) > bend || std::max(c0, end) < -bend) return;
  const auto try_at = [&](double time) {
    if (!(time <= 1) ||
        !first.yields_to(time, segment, stimuli::SurfaceTriangle::triangle_of(side)))
      return;
    const Vec3 along = from.along + time * turn;
    const double left = glm::dot(edge.left.normal, along),
                 right = glm::dot(edge.right.normal, along), level = kSilhouette * length;
    const double rate = c1 + 2 * c2 * time;
    const bool up = left >= -level && right <= level, down = left <= level && right >= -level;
    if (!((up && rate < 0) || (down && rate > 0))) return;
    // Where the two lines cross.
    const Vec3 apart = r + time * way;  // from v0 to the start
    const Vec3 normal = glm::cross(e, along);
    const double size2 = glm::dot(normal, normal);
    if (!(size2 > 0)) return;
    const double reach = glm::length(along);
    const double u = glm::dot(glm::cross(apart, along), normal) / size2 * edge_length;
    const double s = glm::dot(glm::cross(apart, e), normal) / size2 * reach;
    if (u < -slack || u > edge_length + slack || s < -slack || s > reach + slack) return;
    first = {{side, segment, false, PatchKind::edge}, std::max(0.0, time)};
  };
  if (std::abs(c0) <= rounding) try_at(0);
  if (std::abs(c2) <= 1e-14 * (std::abs(c0) + std::abs(c1))) {
    if (c1 != 0 && -c0 / c1 >= 0) try_at(-c0 / c1);
    return;
  }
  const double root2 = c1 * c1 - 4 * c2 * c0;
  if (root2 < 0) return;
  const double q = -0.5 * (c1 + std::copysign(std::sqrt(root2), c1));
  const double one = q / c2;
  if (one >= 0) try_at(one);
  if (q != 0 && c0 / q >= 0) try_at(c0 / q);
}

}  // namespace

bool exists(const stimuli::Surface& surface, const SurfacePatch& patch, const PosedTool& tool) {
  const Vec3& along = tool.segments[patch.segment].along;
  const stimuli::SurfaceTriangle& t = surface.triangles()[patch.triangle()];
  if (patch.kind == PatchKind::face) return by_tip(t, along) != patch.tail;
  const std::uint32_t across = t.across[stimuli::SurfaceTriangle::side_of(patch.side)];
  return by_tip(t, along) !=
         by_tip(surface.triangles()[stimuli::SurfaceTriangle::triangle_of(across)], along);
}

PatchPlane plane_of(const stimuli::Surface& surface, const SurfacePatch& patch,
                    const PosedTool& tool) {
  const PosedTool::Segment& segment = tool.segments[patch.segment];
  if (patch.kind == PatchKind::face) {
    const stimuli::SurfaceTriangle& t = surface.triangles()[patch.triangle()];
    const Vec3 end = segment.end(patch.tail);
    if (t.shares_plane()) return {t.normal, t.offset - glm::dot(t.normal, end)};
    return {t.normal, glm::dot(t.normal, surface.vertices()[t.corners[0]] - end)};
  }
  const EdgeOf edge = edge_of(surface, patch.side);
  const double left = glm::dot(edge.left.normal, segment.along),
               right = glm::dot(edge.right.normal, segment.along);
  PatchPlane plane;
  plane.normal = edge_normal(edge, segment.along, left, right);
  plane.depth = glm::dot(plane.normal, edge.v0 - segment.start);
  return plane;
}

PatchPolygon polygon_of(const stimuli::Surface& surface, const SurfacePatch& patch,
                        const PosedTool& tool) {
  const PosedTool::Segment& segment = tool.segments[patch.segment];
  PatchPolygon out;
  if (patch.kind == PatchKind::face) {
    const stimuli::SurfaceTriangle& t = surface.triangles()[patch.triangle()];
    const Vec3 end = segment.end(patch.tail);
    out.count = 3;
    for (std::size_t k = 0; k < 3; ++k) out.corners[k] = surface.vertices()[t.corners[k]] - end;
    return out;
  }
  const EdgeOf edge = edge_of(surface, patch.side);
  const Vec3 tail = segment.end(true);
  out.count = 4;
  out.corners = {edge.v1 - segment.start, edge.v0 - segment.start, edge.v0 - tail, edge.v1 - tail};
  if (!by_tip(edge.left, segment.along)) std::reverse(out.corners.begin(), out.corners.end());
  return out;
}

SurfacePatch patch_after_turn(const stimuli::Surface& surface, const SurfacePatch& patch,
                              const PosedTool& tool) {
  if (patch.kind != PatchKind::edge) return patch;
  const Vec3& along = tool.segments[patch.segment].along;
  const EdgeOf edge = edge_of(surface, patch.side);
  if (by_tip(edge.left, along) != by_tip(edge.right, along)) return patch;
  // Continue on the triangle that turned away.
  const bool left =
      std::abs(glm::dot(edge.left.normal, along)) <= std::abs(glm::dot(edge.right.normal, along));
  const std::uint32_t triangle =
      left ? patch.triangle()
           : stimuli::SurfaceTriangle::triangle_of(
                 surface.triangles()[patch.triangle()]
                     .across[stimuli::SurfaceTriangle::side_of(patch.side)]);
  return {triangle << 2, patch.segment, !by_tip(edge.left, along), PatchKind::face};
}

bool meets(const PatchPolygon& polygon, const Vec3& from, const Vec3& way, double border) {
  // Seen along the way, in two dimensions: each corner is rounded once, then signs are exact.
  const Vec3 size = glm::abs(way);
  const int z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const int x = (z + 1) % 3, y = (z + 2) % 3;
  const double shear_x = way[x] / way[z], shear_y = way[y] / way[z];
  std::array<double, 4> u{}, v{};
  for (std::size_t k = 0; k < polygon.count; ++k) {
    const Vec3 to = polygon.corners[k] - from;
    u[k] = to[x] - shear_x * to[z];
    v[k] = to[y] - shear_y * to[z];
  }
  const auto turns_right = [&](std::size_t i, std::size_t k) {
    const double one = u[i] * v[k], other = u[k] * v[i];
    double turn = one - other;  // the products keep their order in rounding
    if (one == other) turn = std::fma(u[i], v[k], -one) - std::fma(u[k], v[i], -other);
    if (way[z] < 0) turn = -turn;
    return turn <= 0 ||
           (border > 0 && turn <= border * (std::abs(u[k] - u[i]) + std::abs(v[k] - v[i])));
  };
  if (turns_right(0, 1) && turns_right(1, 2) && turns_right(2, 0)) return true;
  return polygon.count == 4 && turns_right(0, 2) && turns_right(2, 3) && turns_right(3, 0);
}

double distance_off(const PatchPolygon& polygon, const Vec3& normal, const Vec3& at) {
  const Vec3 p = at - glm::dot(normal, at - polygon.corners[0]) * normal;
  const auto next = [&](std::size_t k) -> const Vec3& {
    return polygon.corners[k + 1 == polygon.count ? 0 : k + 1];
  };
  bool over = true;
  for (std::size_t k = 0; k < polygon.count && over; ++k) {
    const Vec3& a = polygon.corners[k];
    over = glm::dot(normal, glm::cross(next(k) - a, p - a)) >= 0;
  }
  if (over) return 0;
  double nearest = HUGE_VAL;
  for (std::size_t k = 0; k < polygon.count; ++k)
    nearest = std::min(nearest, to_side(p, polygon.corners[k], next(k)));
  return std::sqrt(nearest);
}

void cast_on_patch(const stimuli::Surface& surface, const SurfacePatch& patch,
                   const PatchPlane& plane, const PosedTool& tool, const Vec3& from, const Vec3& to,
                   double tolerance, double border, PatchHit& first) {
  const double start = glm::dot(plane.normal, from) - plane.depth,
               end = glm::dot(plane.normal, to) - plane.depth;
  if (end > 0 || start < -tolerance || !(end < start)) return;
  const double time = std::max(0.0, start / (start - end));
  if (!first.yields_to(time, patch.segment, patch.triangle())) return;
  const PatchPolygon polygon = polygon_of(surface, patch, tool);
  const Vec3 way = to - from;
  if (goes_through(polygon, plane.normal, from, way, time, tolerance, border))
    first = {patch, time};
}

void sweep_triangle(const stimuli::Surface& surface, std::uint32_t index, std::uint8_t segment,
                    std::uint8_t what, const PosedTool::Segment& from, const PosedTool::Segment& to,
                    double tolerance, double slack, double border, PatchHit& first) {
  if ((what & stimuli::surface_pair::kTip) != 0)
    sweep_end(surface, index, segment, false, from.start, to.start, tolerance, border, first);
  if (from.along == Vec3(0) && to.along == Vec3(0)) return;
  if ((what & stimuli::surface_pair::kTail) != 0)
    sweep_end(surface, index, segment, true, from.end(true), to.end(true), tolerance, border,
              first);
  if ((what & stimuli::surface_pair::kSides) == 0) return;
  const stimuli::SurfaceTriangle& t = surface.triangles()[index];
  const double first_slope = glm::dot(t.normal, from.along),
               last_slope = glm::dot(t.normal, to.along),
               level = 2 * kSilhouette * glm::length(from.along);
  for (std::uint32_t k = 0; k < 3; ++k) {
    if ((what >> k & 1) == 0 || !t.owns(k) || !t.touches(k)) continue;
    // Both triangles face the same way all the time.
    const Vec3& beyond =
        surface.triangles()[stimuli::SurfaceTriangle::triangle_of(t.across[k])].normal;
    const double first_beyond = glm::dot(beyond, from.along),
                 last_beyond = glm::dot(beyond, to.along);
    if (std::max(std::max(first_slope, last_slope), std::max(first_beyond, last_beyond)) < -level ||
        std::min(std::min(first_slope, last_slope), std::min(first_beyond, last_beyond)) > level)
      continue;
    sweep_edge(surface, index << 2 | k, segment, from, to, tolerance, slack, first);
  }
}

}  // namespace palpate::rendering
