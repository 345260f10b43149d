#include "rendering/surface_contact.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "rendering/surface_query.h"
#include "rendering/surface_tool.h"

namespace palpate::rendering {
namespace {

constexpr std::size_t kFewNear = 12, kManyNear = 48;    // triangles that a list is to have
constexpr double kSmallRoom = 1e-6, kLargeRoom = 0.25;  // of the size
constexpr double kStep = 0.02;                          // rad; a larger turn is taken in steps
constexpr int kMostSteps = 64, kContactSteps = 8;       // of a tick with a first contact

}  // namespace

/// Local frame.
PosedTool SurfaceTool::pose(const ToolPose& at) const {
  PosedTool out;
  out.count = carried_ == nullptr ? 1 : carried_->segments.size();
  for (std::size_t j = 0; j < out.count; ++j) {
    const PlacedSegment segment = place_segment(carried_, tick_.sides, at, j);
    out.segments[j] = {placed_.local_point(at.tip + segment.from),
                       placed_.local_vector(segment.along)};
  }
  return out;
}

SurfacePlane SurfaceTool::plane_at(const SurfacePatch& patch) const {
  const PatchPlane plane = plane_of(surface_, patch, turned_);
  return {patch, plane.normal, plane.depth};
}

/// m, of any end of a segment, from where it was when triangles were listed.
double SurfaceTool::moved_from_list(const PosedTool& at, const Vec3& by) const {
  double most2 = 0;
  for (std::size_t j = 0; j < at.count; ++j) {
    const Vec3 start = at.segments[j].start + by - own_.listed.segments[j].start;
    const Vec3 end = start + at.segments[j].along - own_.listed.segments[j].along;
    most2 = std::max({most2, glm::dot(start, start), glm::dot(end, end)});
  }
  return std::sqrt(most2);
}

/// Lists the triangles within `room` of the tool; none where they are too many.
void SurfaceTool::list(const PosedTool& at, double room) {
  own_.near.clear();
  own_.listed = at;
  own_.room = room;
  own_.has_list = true;
  const double far = room + 4 * skin_;
  for (std::size_t j = 0; j < at.count && own_.has_list; ++j) {
    const PosedTool::Segment& segment = at.segments[j];
    surface_.near_segment(segment.start, segment.along, far, [&](std::uint32_t triangle) {
      const std::uint8_t what = within(triangle, segment, far);
      if (what == 0) return true;
      own_.has_list = own_.near.size() < own_.near.capacity();
      if (own_.has_list) own_.near.push_back({triangle, static_cast<std::uint8_t>(j), what});
      return own_.has_list;
    });
  }
}

/// What of a triangle and a segment can come together while no end of that moves farther than
/// `far`.
std::uint8_t SurfaceTool::within(std::uint32_t index, const PosedTool::Segment& segment,
                                 double far) const {
  const SurfaceTriangle& t = surface_.triangles()[index];
  const Vec3 &a = surface_.vertices()[t.corners[0]], &b = surface_.vertices()[t.corners[1]],
             &c = surface_.vertices()[t.corners[2]];
  const Vec3 low = glm::min(a, glm::min(b, c)) - far, high = glm::max(a, glm::max(b, c)) + far;
  const auto end_is_near = [&](const Vec3& p) {
    return std::abs(glm::dot(t.normal, p - a)) <= far && p.x >= low.x && p.y >= low.y &&
           p.z >= low.z && p.x <= high.x && p.y <= high.y && p.z <= high.z;
  };
  std::uint8_t what = end_is_near(segment.start) ? surface_pair::kTip : std::uint8_t{0};
  if (segment.along == Vec3(0)) return what;
  if (end_is_near(segment.end(true))) what |= surface_pair::kTail;
  // The ends may move opposite ways.
  const double turn = 2 * far, own = glm::dot(t.normal, segment.along);
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (!owns(t, index, k) || !t.touches(k)) continue;
    const double other = glm::dot(
        surface_.triangles()[SurfaceTriangle::triangle_of(t.across[k])].normal, segment.along);
    if (std::min(own, other) > turn || std::max(own, other) < -turn) continue;
    what |= static_cast<std::uint8_t>(1U << k);
  }
  return what;
}

/// Sees to it that a motion of the tool stays among the triangles that are listed.
void SurfaceTool::keep_list(const PosedTool& from, const PosedTool& to) {
  const std::size_t few = kFewNear * to.count, many = kManyNear * to.count;
  const double size = surface_.size();
  const bool crowded = own_.near.size() > many && own_.room > own_.wanted_room;
  if (own_.has_list && !crowded && moved_from_list(from, Vec3(0)) < 0.75 * own_.room &&
      moved_from_list(to, Vec3(0)) < 0.75 * own_.room)
    return;
  if (!(own_.wanted_room > 0)) own_.wanted_room = 0.01 * size;
  own_.listed = to;
  const double needed = 3 * moved_from_list(from, Vec3(0)) + 8 * skin_;
  double room = std::max(needed, own_.wanted_room);
  list(to, room);
  while ((!own_.has_list || own_.near.size() > many) && room > needed) {
    room = std::max(needed, 0.5 * room);
    list(to, room);
  }
  // A leap has a long list of its own.
  if (own_.has_list && own_.near.size() < few)
    own_.wanted_room = 1.5 * room;
  else
    own_.wanted_room = std::min(room, own_.wanted_room);
  own_.wanted_room = std::clamp(own_.wanted_room, kSmallRoom * size, kLargeRoom * size);
}

/// Whether the virtual tool, which nothing holds, can touch nothing in this tick.
bool SurfaceTool::far_away() {
  const PosedTool before = pose(tick_.state.has_last ? all_.last : tick_.tool),
                  now = pose(tick_.tool);
  double step2 = 0, distance2 = HUGE_VAL;
  for (std::size_t j = 0; j < now.count; ++j) {
    const PosedTool::Segment &a = before.segments[j], &b = now.segments[j];
    const Vec3 start = b.start - a.start, end = start + b.along - a.along;
    step2 = std::max({step2, glm::dot(start, start), glm::dot(end, end)});
    const Vec3 to = surface_.centre() - b.start;
    const double length2 = glm::dot(b.along, b.along);
    const double t = length2 > 0 ? std::clamp(glm::dot(to, b.along) / length2, 0.0, 1.0) : 0.0;
    const Vec3 apart = to - t * b.along;
    distance2 = std::min(distance2, glm::dot(apart, apart));
  }
  const double near = surface_.radius() + std::sqrt(step2) + 2 * skin_;
  if (distance2 > near * near) return true;
  keep_list(before, now);
  return own_.has_list && own_.near.empty() && moved_from_list(before, Vec3(0)) < own_.room &&
         moved_from_list(now, Vec3(0)) < own_.room;
}

/// Takes the ideal tool from a pose outside of the surface to as near to another as it may be.
void SurfaceTool::step(const ToolPose& target, const ToolPose& from) {
  target_ = target;
  // A turn that leads into a crack, or to no rest, is halved.
  double most = 1;
  do {
    most = 0.5 * turn(from, most);
    stuck_ = false;
    resume_planes();
    collect_patches();
    translate();
  } while (most > 0 && (stuck_ || in_crack_ || !planes_.leave_room()));
  own_.carrying_count = 0;
  for (const SurfacePlane& plane : planes_.all())
    own_.carrying[own_.carrying_count++] = plane.patch;
}

void SurfaceTool::follow() {
  const std::size_t first_contact = all_.contacts.size();
  ToolPose from = memory_.ideal;
  if (!memory_.touching) {
    if (far_away()) return;
    from = tick_.state.has_last ? all_.last : tick_.tool;
    memory_.grasp = Vec3(0);
    own_.carrying_count = 0;
    int steps =
        std::clamp(static_cast<int>(std::ceil(angle_between(carried_, from, tick_.tool) / kStep)),
                   1, kMostSteps);
    const auto go = [&] {
      ToolPose at = from;
      for (int i = 1; i <= steps; ++i) {
        step(i == steps ? tick_.tool : between(from, tick_.tool, double(i) / steps), at);
        at = pose_;
        at.tip = target_.tip + placed_.world_vector(at_);
      }
    };
    go();
    if (!planes_.empty() && steps < kContactSteps) {
      // In finer steps it meets what comes first.
      steps = kContactSteps;
      own_.carrying_count = 0;
      go();
    }
  } else {
    step(tick_.tool, from);
  }
  add_contacts();
  remember(first_contact);
}

bool SurfaceTool::virtual_inside() {
  const PosedTool now = pose(target_);
  bool inside = false;
  for (std::size_t j = 0; j < now.count && !inside; ++j) {
    const PosedTool::Segment& segment = now.segments[j];
    inside = surface_.winding(segment.start) > 0;
    if (inside || segment.along == Vec3(0)) continue;
    surface_.near_segment(segment.start, segment.along, 0, [&](std::uint32_t index) {
      const SurfaceTriangle& t = surface_.triangles()[index];
      const double a = glm::dot(t.normal, segment.start) - t.offset,
                   b = a + glm::dot(t.normal, segment.along);
      if (std::min(a, b) > -tolerance_ || std::max(a, b) < tolerance_) return true;
      PatchPolygon polygon;
      polygon.count = 3;
      for (std::size_t k = 0; k < 3; ++k) polygon.corners[k] = surface_.vertices()[t.corners[k]];
      inside = b < a ? meets(polygon, segment.start, segment.along)
                     : meets(polygon, segment.end(true), -segment.along);
      return !inside;
    });
  }
  return inside;
}

void follow_on_surface(UnionTick& tick, std::uint32_t surface) {
  SurfaceTool(tick, surface).follow();
}

bool inside_surface(UnionTick& tick, std::uint32_t surface) {
  return SurfaceTool(tick, surface).virtual_inside();
}

}  // namespace palpate::rendering
