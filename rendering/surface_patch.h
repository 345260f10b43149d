#pragma once
// Where a tool can touch a closed surface (surface_contact.h): for a fixed orientation of the tool,
// patches in the space of its translations. Local frame of the surface, m.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rendering/surface.h"
#include "rendering/tool.h"

namespace palpate::rendering {

// Searches for triangles near a segment. Included only by callers, because they are inlined.

template <class Visit>
void Surface::near_segment(const Vec3& start, const Vec3& along, double room,
                           const Visit& visit) const {
  // Separating axes of a box and a segment (Ericson 2005, 5.3.3), the box larger by the room.
  const Vec3 half = 0.5 * along, middle = start + half;

  const Vec3 size(std::abs(half.x), std::abs(half.y), std::abs(half.z));
  const auto is_near = [&](const Node& node) {
    const double x = middle.x - static_cast<double>(node.middle[0]),
                 y = middle.y - static_cast<double>(node.middle[1]),
                 z = middle.z - static_cast<double>(node.middle[2]);
    const double a = static_cast<double>(node.half[0]) + room,
                 b = static_cast<double>(node.half[1]) + room,
                 c = static_cast<double>(node.half[2]) + room;
    if (std::abs(x) > a + size.x || std::abs(y) > b + size.y || std::abs(z) > c + size.z)
      return false;
    const double slack = 1e-12 * (a + b + c) * (size.x + size.y + size.z);
    return std::abs(y * half.z - z * half.y) <= b * size.z + c * size.y + slack &&
           std::abs(z * half.x - x * half.z) <= a * size.z + c * size.x + slack &&
           std::abs(x * half.y - y * half.x) <= a * size.y + b * size.x + slack;
  };
  if (nodes_.empty()) return;
  std::array<std::uint32_t, 64> stack{};  // halves at each level
  std::size_t open = 0;
  stack[open++] = 0;
  while (open > 0) {
    const std::uint32_t at = stack[--open];
    const Node& node = nodes_[at];
    if (!is_near(node)) continue;
    if (node.count == 0) {
      __builtin_prefetch(&nodes_[node.first]);
      stack[open++] = node.first;
      stack[open++] = at + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (!visit(order_[i])) return;
    }
  }
}

template <class Visit>
void Surface::touchable(const Vec3& start, const Vec3& along, const Motion& motion,
                        const Visit& visit) const {
  const Vec3 half = 0.5 * along, middle = start + half, tail = start + along;
  const Vec3 size(std::abs(half.x), std::abs(half.y), std::abs(half.z));
  const double length2 = 4 * (half.x * half.x + half.y * half.y + half.z * half.z);
  const double length = std::sqrt(length2), most = std::max(motion.start, motion.end);
  const double per_length2 = length2 > 0 ? 1 / length2 : 0;
  const double turn = motion.turn + 1e-9 * length;
  const auto end_is_near = [](const Node& node, const Vec3& end, double room) {
    return std::abs(end.x - static_cast<double>(node.middle[0])) <=
               static_cast<double>(node.half[0]) + room &&
           std::abs(end.y - static_cast<double>(node.middle[1])) <=
               static_cast<double>(node.half[1]) + room &&
           std::abs(end.z - static_cast<double>(node.middle[2])) <=
               static_cast<double>(node.half[2]) + room;
  };
  const auto side_is_near = [&](const Node& node, const Normals& normals) {
    const double a0 = node.half[0], b0 = node.half[1], c0 = node.half[2];
    const double x = middle.x - static_cast<double>(node.middle[0]),
                 y = middle.y - static_cast<double>(node.middle[1]),
                 z = middle.z - static_cast<double>(node.middle[2]);
    if (std::abs(x) > a0 + most + size.x || std::abs(y) > b0 + most + size.y ||
        std::abs(z) > c0 + most + size.z)
      return false;
    // No edge of the node is a silhouette.
    const double facing = 2 * std::abs(half.x * static_cast<double>(normals.middle[0]) +
                                       half.y * static_cast<double>(normals.middle[1]) +
                                       half.z * static_cast<double>(normals.middle[2]));
    if (facing > turn + length * static_cast<double>(normals.radius)) return false;
    // Farther along, the segment may move farther or less far.
    const double at = 0.5 - 2 * (x * half.x + y * half.y + z * half.z) * per_length2;
    const double reach =
        2 * (a0 * size.x + b0 * size.y + c0 * size.z) * per_length2 + most * length * per_length2;
    const double farthest =
        std::clamp(motion.end > motion.start ? at + reach : at - reach, 0.0, 1.0);
    const double room = motion.start + farthest * (motion.end - motion.start);
    const double a = a0 + room, b = b0 + room, c = c0 + room;
    if (std::abs(x) > a + size.x || std::abs(y) > b + size.y || std::abs(z) > c + size.z)
      return false;
    const double slack = 1e-12 * (a + b + c) * (size.x + size.y + size.z);
    return std::abs(y * half.z - z * half.y) <= b * size.z + c * size.y + slack &&
           std::abs(z * half.x - x * half.z) <= a * size.z + c * size.x + slack &&
           std::abs(x * half.y - y * half.x) <= a * size.y + b * size.x + slack;
  };
  if (nodes_.empty()) return;
  std::array<std::uint32_t, 64> stack{};  // halves at each level
  std::size_t open = 0;
  stack[open++] = 0;
  while (open > 0) {
    const std::uint32_t at = stack[--open];
    const Node& node = nodes_[at];
    if (!(length > 0 && side_is_near(node, normals_[at])) &&
        !end_is_near(node, start, motion.start) && !end_is_near(node, tail, motion.end))
      continue;
    if (node.count == 0) {
      __builtin_prefetch(&nodes_[node.first]);
      __builtin_prefetch(&normals_[node.first]);
      stack[open++] = node.first;
      stack[open++] = at + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (!visit(order_[i])) return;
    }
  }
}

/// A triangle with a segment end, or a non-concave edge with a segment.
struct SurfacePatch {
  enum class Kind : std::uint8_t { none, face, edge };
  std::uint32_t side = 0;  ///< the triangle times four; of an edge its side as well
  std::uint8_t segment = 0;
  bool tail = false;  ///< face only: the end that touches
  Kind kind = Kind::none;

  std::uint32_t triangle() const { return side >> 2; }
  friend bool operator==(const SurfacePatch&, const SurfacePatch&) = default;
};

/// The segments of a tool where they are.
struct PosedTool {
  struct Segment {
    Vec3 start, along;
    Vec3 end(bool tail) const { return tail ? start + along : start; }
  };
  std::array<Segment, Tool::kMostSegments> segments;
  std::size_t count = 0;
};

/// A patch's plane: translations y of the tool with dot(normal, y) >= depth are outside.
struct PatchPlane {
  Vec3 normal;  ///< unit
  double depth = 0;
};

/// Its polygon, counter-clockwise seen from outside. Patches that share a side have the same
/// corners there, to the bit.
struct PatchPolygon {
  std::array<Vec3, 4> corners;
  std::size_t count = 0;
};

/// Whether the triangle is touched by the tip of a segment of this direction, not by its tail.
inline bool by_tip(const SurfaceTriangle& triangle, const Vec3& along) {
  return triangle.normal.x * along.x + triangle.normal.y * along.y + triangle.normal.z * along.z >=
         0;
}

/// \param tool  with the translation 0
PatchPlane plane_of(const Surface& surface, const SurfacePatch& patch, const PosedTool& tool);
PatchPolygon polygon_of(const Surface& surface, const SurfacePatch& patch, const PosedTool& tool);

/// The patch that replaces this one after a turn in which its edge stopped being a silhouette; else
/// the same patch.
SurfacePatch patch_after_turn(const Surface& surface, const SurfacePatch& patch,
                              const PosedTool& tool);

/// Whether a line in the direction of `way` from `from`, against the normal, goes through the
/// polygon. One expression decides for both patches at a side (Woop, Benthin & Wald 2013), and one
/// that goes through the side itself goes through both.
bool meets(const PatchPolygon& polygon, const Vec3& from, const Vec3& way);

/// m, distance of a translation from the polygon along its plane; 0 above the polygon.
double distance_off(const PatchPolygon& polygon, const Vec3& normal, const Vec3& at);

/// Where a motion of the tool first meets a patch.
struct PatchHit {
  SurfacePatch patch;
  double time = 2;  ///< fraction of the motion; above 1: no hit
  bool hit() const { return time <= 1; }
};

/// Replaces `first` if a translation from `from` to `to` enters the patch earlier.
/// \param tolerance  m; a tool less than this behind a plane counts as before it
void cast_on_patch(const Surface& surface, const SurfacePatch& patch, const PatchPlane& plane,
                   const PosedTool& tool, const Vec3& from, const Vec3& to, double tolerance,
                   PatchHit& first);

/// Bits for the parts of a triangle and a segment that can touch.
namespace surface_pair {
inline constexpr std::uint8_t kSides = 7;  ///< bit k: side k, which is the triangle's own
inline constexpr std::uint8_t kTip = 8, kTail = 16;
inline constexpr std::uint8_t kAll = 31;
}  // namespace surface_pair

/// The same for a segment whose ends move linearly, over all patches of a triangle and its own
/// sides. \param what   patches to test; bits of surface_pair \param slack  m; edges and segment
/// are extended by it
void sweep_triangle(const Surface& surface, std::uint32_t triangle, std::uint8_t segment,
                    std::uint8_t what, const PosedTool::Segment& from, const PosedTool::Segment& to,
                    double tolerance, double slack, PatchHit& first);

/// Calls visit(patch) for the patches of a triangle and its own sides.
template <class Visit>
void for_each_patch(const Surface& surface, std::uint32_t index, std::uint8_t segment,
                    std::uint8_t what, const Vec3& along, const Visit& visit) {
  const SurfaceTriangle& triangle = surface.triangles()[index];
  const bool tip = by_tip(triangle, along);
  if ((what & (tip ? surface_pair::kTip : surface_pair::kTail)) != 0)
    visit(SurfacePatch{index << 2, segment, !tip, SurfacePatch::Kind::face});
  if ((what & surface_pair::kSides) == 0 || along == Vec3(0)) return;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if ((what >> k & 1) == 0 || !owns(triangle, index, k) || !triangle.touches(k)) continue;
    if (by_tip(surface.triangles()[SurfaceTriangle::triangle_of(triangle.across[k])], along) == tip)
      continue;
    visit(SurfacePatch{index << 2 | k, segment, false, SurfacePatch::Kind::edge});
  }
}

}  // namespace palpate::rendering
