#pragma once
// Where a tool can touch a closed surface (surface_contact.h): for a fixed orientation of the tool,
// patches in the space of its translations. Local frame of the surface, m.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rendering/tool.h"
#include "stimuli/surfaces/surface.h"

namespace palpate::rendering {

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

/// The segments of a tool where they are. Only those that exist are initialised and copied: there
/// is room for many, and a tick makes several of these.
struct PosedTool {
  PosedTool() {}  // NOLINT(modernize-use-equals-default): that would be deleted
  PosedTool(const PosedTool& other) { *this = other; }
  PosedTool& operator=(const PosedTool& other) {
    count = other.count;
    std::copy_n(other.segments.begin(), count, segments.begin());
    return *this;
  }
  struct Segment {
    Vec3 start, along;
    Vec3 end(bool tail) const { return tail ? start + along : start; }
  };
  union {
    std::array<Segment, Tool::kMostSegments> segments;
  };
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
inline bool by_tip(const stimuli::SurfaceTriangle& triangle, const Vec3& along) {
  return triangle.normal.x * along.x + triangle.normal.y * along.y + triangle.normal.z * along.z >=
         0;
}

/// \param tool  with the translation 0
PatchPlane plane_of(const stimuli::Surface& surface, const SurfacePatch& patch,
                    const PosedTool& tool);
PatchPolygon polygon_of(const stimuli::Surface& surface, const SurfacePatch& patch,
                        const PosedTool& tool);

/// The patch that replaces this one after a turn in which its edge stopped being a silhouette; else
/// the same patch.
SurfacePatch patch_after_turn(const stimuli::Surface& surface, const SurfacePatch& patch,
                              const PosedTool& tool);

/// Whether a line in the direction of `way` from `from`, against the normal, goes through the
/// polygon. One expression decides for both patches at a side (Woop, Benthin & Wald 2013), and one
/// that goes through the side itself goes through both. \param border  m; a line that passes beside
/// a side goes through it as well, no farther than one to two times this, seen along an axis
bool meets(const PatchPolygon& polygon, const Vec3& from, const Vec3& way, double border = 0);

/// m, distance of a translation from the polygon along its plane; 0 above the polygon.
double distance_off(const PatchPolygon& polygon, const Vec3& normal, const Vec3& at);

/// Whether the patch is one for the tool in this orientation.
bool exists(const stimuli::Surface& surface, const SurfacePatch& patch, const PosedTool& tool);

/// Where a motion of the tool first meets a patch.
struct PatchHit {
  SurfacePatch patch;
  double time = 2;  ///< fraction of the motion; above 1: no hit
  bool hit() const { return time <= 1; }
  /// Whether a patch that is met then replaces this one: the earlier one, else the first triangle,
  /// so that the order of a search does not matter.
  bool yields_to(double then, std::uint8_t segment, std::uint32_t triangle) const {
    return then < time || (then == time && segment == patch.segment && triangle < patch.triangle());
  }
};

/// Replaces `first` if a translation from `from` to `to` enters the patch earlier.
/// \param tolerance  m; a tool less than this behind a plane counts as before it
/// \param border  m; so far beyond its border the patch is met as well
void cast_on_patch(const stimuli::Surface& surface, const SurfacePatch& patch,
                   const PatchPlane& plane, const PosedTool& tool, const Vec3& from, const Vec3& to,
                   double tolerance, double border, PatchHit& first);

/// The same for a segment whose ends move linearly, over all patches of a triangle and its own
/// sides. \param what   patches to test; bits of surface_pair \param slack  m; edges and segment
/// are extended by it \param border  m; so far beyond its border a triangle is met as well
void sweep_triangle(const stimuli::Surface& surface, std::uint32_t triangle, std::uint8_t segment,
                    std::uint8_t what, const PosedTool::Segment& from, const PosedTool::Segment& to,
                    double tolerance, double slack, double border, PatchHit& first);

/// Calls visit(patch) for the patches of a triangle and its own sides.
template <class Visit>
void for_each_patch(const stimuli::Surface& surface, std::uint32_t index, std::uint8_t segment,
                    std::uint8_t what, const Vec3& along, const Visit& visit) {
  const stimuli::SurfaceTriangle& triangle = surface.triangles()[index];
  const bool tip = by_tip(triangle, along);
  if ((what & (tip ? stimuli::surface_pair::kTip : stimuli::surface_pair::kTail)) != 0)
    visit(SurfacePatch{index << 2, segment, !tip, SurfacePatch::Kind::face});
  if ((what & stimuli::surface_pair::kSides) == 0 || along == Vec3(0)) return;
  for (std::uint32_t k = 0; k < 3; ++k) {
    if ((what >> k & 1) == 0 || !triangle.owns(k) || !triangle.touches(k)) continue;
    if (by_tip(surface.triangles()[stimuli::SurfaceTriangle::triangle_of(triangle.across[k])],
               along) == tip)
      continue;
    visit(SurfacePatch{index << 2 | k, segment, false, SurfacePatch::Kind::edge});
  }
}

}  // namespace palpate::rendering
