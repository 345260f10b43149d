#include "rendering/surface_contact.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "rendering/probes.h"
#include "rendering/render_fault.h"
#include "rendering/surface_patch.h"
#include "rendering/surface_tool.h"
#include "stimuli/surfaces/surface_search.h"

namespace palpate::rendering {
namespace {

constexpr double kSmallRoom = 1e-6, kLargeRoom = 0.25;  // of the size
constexpr double kStep = 0.02;                          // rad; larger turns are divided
constexpr int kMostSteps = 64;                          // of a tick

using PatchKind = SurfacePatch::Kind;

constexpr double kLevel = 1e-12;    // sine; a segment along a triangle
constexpr int kMostFaces = 64;      // to each side of a contact
constexpr double kFlat = 1 - 5e-9;  // cosine of 1e-4 rad: rounding may bend a flat face so far

/// Angle of the segment to a triangle, of the blend angle, -1 to 1; 1: its tip dips.
double turned_to(const stimuli::SurfaceTriangle& triangle, const Vec3& d, double length) {
  const double slope = glm::dot(triangle.normal, d);
  if (slope >= tick::kSinBlendAngle * length) return 1;
  if (slope <= -tick::kSinBlendAngle * length) return -1;
  return std::clamp(tick::small_asin(slope / length) / tick::kBlendAngle, -1.0, 1.0);
}

/// A segment that lies on a surface, from tip to tip + d.
class Lying {
 public:
  Lying(const stimuli::Surface& surface, const Vec3& tip, const Vec3& d)
      : surface_(surface), tip_(tip), d_(d), length_(glm::length(d)) {}

  struct Crossed {
    tick::Portion portion;
    std::uint32_t next;  ///< side of the triangle beyond
  };

  double turned(std::uint32_t triangle) const {
    return turned_to(surface_.triangles()[triangle], d_, length_);
  }

  /// The portion of the segment over a triangle, in its plane, and the side where it leaves.
  Crossed crossed(std::uint32_t index, bool towards_end) const {
    const stimuli::SurfaceTriangle& t = surface_.triangles()[index];
    Crossed out{{}, 0};
    double nearest = HUGE_VAL;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Vec3& a = surface_.vertices()[t.corners[k]];
      const Vec3 inward = glm::cross(t.normal, surface_.vertices()[t.corners[(k + 1) % 3]] - a);
      const double height = glm::dot(inward, tip_ - a), slope = glm::dot(inward, d_);
      const double at_side = -height / slope;
      out.portion.clip(height, slope);
      if (!(towards_end ? slope < 0 : slope > 0)) continue;
      const double way = towards_end ? at_side : -at_side;
      if (way >= nearest) continue;
      nearest = way;
      out.next = t.across[k];
    }
    return out;
  }

  /// How far this triangle and the following ones, towards the end or the beginning, move the point
  /// from `from`. Counts the triangles within the blend angle in `along`.
  double way(std::uint32_t triangle, double from, bool towards_end, int& along) const {
    double moved = 0;
    for (int i = 0; i < kMostFaces; ++i) {
      const double angle = turned(triangle);
      if (towards_end ? angle >= 1 : angle <= -1) break;
      const Crossed at = crossed(triangle, towards_end);
      if (i > 0 && std::abs(angle) >= 1) break;
      if (!(at.portion.enter <= at.portion.leave) && i > 0) break;
      const double end =
          towards_end ? std::max(from, at.portion.leave) : std::min(from, at.portion.enter);
      along += std::abs(angle) < 1;
      moved += (end - from) * 0.5 * (towards_end ? 1 - angle : 1 + angle);
      from = end;
      if (towards_end ? from >= 1 : from <= 0) break;
      const stimuli::SurfaceTriangle& beyond =
          surface_.triangles()[stimuli::SurfaceTriangle::triangle_of(at.next)];
      const std::uint32_t side = stimuli::SurfaceTriangle::side_of(at.next);
      // Across a hollow, the segment touches only one of its sides.
      if ((!beyond.touches(side) || beyond.folded(side)) &&
          glm::dot(beyond.normal, surface_.triangles()[triangle].normal) < kFlat)
        break;
      triangle = stimuli::SurfaceTriangle::triangle_of(at.next);
    }
    return moved;
  }

  double length() const { return length_; }

 private:
  const stimuli::Surface& surface_;
  Vec3 tip_, d_;
  double length_;
};

/// Where the segment touches: equation (2) over the triangles that it lies along.
/// \param at  of the patch's own contact point on the segment
/// \param pressed  share of the segment about that point that lies on the surface (texture.h)
double place_on(const stimuli::Surface& surface, const SurfacePatch& patch, const Vec3& tip,
                const Vec3& d, double at, ContactType& type, double& pressed) {
  const Lying lying(surface, tip, d);
  const std::uint32_t left = patch.triangle();
  int along = 0;
  double forwards = 0, back = 0;
  if (patch.kind == PatchKind::edge) {
    const std::uint32_t right = stimuli::SurfaceTriangle::triangle_of(
        surface.triangles()[left].across[stimuli::SurfaceTriangle::side_of(patch.side)]);
    // The triangle ahead slopes down along the segment.
    const bool left_ahead = by_tip(surface.triangles()[left], d);
    const std::uint32_t ahead = left_ahead ? left : right, behind = left_ahead ? right : left;
    forwards = lying.way(ahead, at, true, along);
    back = lying.way(behind, at, false, along);
  } else {
    forwards = lying.way(left, at, true, along);
    back = lying.way(left, at, false, along);
  }
  if (along == 0) return at;
  type = ContactType::segment_face;
  pressed = 2 * (forwards - back);
  return std::clamp(at + forwards + back, 0.0, 1.0);
}

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

/// m, the farthest that it reaches from its tip.
double SurfaceTool::tool_size() const {
  return carried_ != nullptr ? tick_.scene.tool_reach() : glm::length(tick_.tool.d);
}

/// Whether the segment can touch nothing within the motion.
bool SurfaceTool::is_clear(const stimuli::SegmentMotion& motion) const {
  bool clear = true;
  surface_.touchable(motion, [&](std::uint32_t, std::uint8_t) { return clear = false; });
  return clear;
}

/// Whether a free virtual tool cannot touch anything in this tick.
bool SurfaceTool::far_away() {
  const ToolPose& last = tick_.state.has_last ? all_.last : tick_.tool;
  const PosedTool before = pose(last), now = pose(tick_.tool);
  double step2 = 0, distance2 = HUGE_VAL, from_clear2 = 0;
  const auto far = [](const PosedTool::Segment& a, const PosedTool::Segment& b) {
    const Vec3 start = b.start - a.start, end = start + b.along - a.along;
    return std::max(glm::dot(start, start), glm::dot(end, end));
  };
  for (std::size_t j = 0; j < now.count; ++j) {
    const PosedTool::Segment& b = now.segments[j];
    step2 = std::max(step2, far(before.segments[j], b));
    if (own_.clear_room > 0) {
      const PosedTool::Segment& clear = own_.clear.segments[j];
      from_clear2 = std::max({from_clear2, far(clear, before.segments[j]), far(clear, b)});
    }
    const Vec3 to = surface_.centre() - b.start;
    const double length2 = glm::dot(b.along, b.along);
    const double t = length2 > 0 ? std::clamp(glm::dot(to, b.along) / length2, 0.0, 1.0) : 0.0;
    const Vec3 apart = to - t * b.along;
    distance2 = std::min(distance2, glm::dot(apart, apart));
  }
  const double step = std::sqrt(step2), near = surface_.radius() + step + 2 * skin_;
  if (distance2 > near * near) return true;
  if (own_.clear_room > 0 && from_clear2 < own_.clear_room * own_.clear_room) return true;
  // In this tick it turns about its tip, by less than kStep at once, and translates.
  const double angle = angle_between(carried_, last, tick_.tool);
  const double aside = glm::length(placed_.local_vector(tick_.tool.tip - last.tip)) + angle * step;
  const auto is_free = [&] {
    if (angle > kStep) return false;
    for (std::size_t j = 0; j < now.count; ++j) {
      const PosedTool::Segment &a = before.segments[j], &b = now.segments[j];
      if (!is_clear({a.start, a.end(true), b.start - a.start, b.end(true) - a.end(true),
                     aside + 4 * skin_, 2 * aside}))
        return false;
    }
    return true;
  };
  // Without room at the last tick there is hardly any now.
  const bool had_room = own_.clear_room > 0;
  if (!had_room && angle <= kStep && !is_free()) return false;
  // Look for room for some ticks.
  const double size = surface_.size(), needed = 2 * step + 8 * skin_;
  const double room = std::max(needed, own_.wanted_clear_room);
  bool clear = true;
  for (std::size_t j = 0; j < now.count && clear; ++j) {
    const PosedTool::Segment& b = now.segments[j];
    clear = is_clear({b.start, b.end(true), Vec3(0), Vec3(0), room, 2 * room});
  }
  own_.clear = now;
  own_.clear_room = clear ? room - 4 * skin_ : 0;
  own_.wanted_clear_room =
      std::clamp((clear ? 2 : 0.5) * room, kSmallRoom * size, kLargeRoom * size);
  if (clear) return true;
  return had_room ? is_free() : angle <= kStep;
}

/// Moves the ideal tool from a pose outside the surface as near to another pose as it can get.
void SurfaceTool::step(const ToolPose& target, const ToolPose& from) {
  target_ = target;
  // If a turn ends in a crack or nowhere at rest, try half of it.
  double most = 1;
  do {
    most = 0.5 * turn(from, most);
    rest();
  } while (most > 0 && !is_at_ease());
  carry();
}

/// The same for a free tool: it goes straight until it meets the first patch.
void SurfaceTool::meet(const ToolPose& target, const ToolPose& from) {
  target_ = target;
  stuck_ = false;
  if (approach(from)) {
    if (planes_.empty() && at_ == Vec3(0)) return;
    rest();
    if (is_at_ease()) return carry();
  }
  step(target, from);
}

void SurfaceTool::rest() {
  stuck_ = false;
  resume_planes();
  translate();
}

void SurfaceTool::carry() {
  if (step_ && !stuck_) leave_steps();
  own_.carrying_count = 0;
  for (const SurfacePlane& plane : planes_.all()) {
    if (!plane.step) own_.carrying[own_.carrying_count++] = plane.patch;
  }
}

void SurfaceTool::follow() {
  const std::size_t first_contact = all_.contacts.size();
  if (memory_.touching) {
    step(tick_.tool, memory_.ideal);
  } else {
    if (far_away()) return;
    const ToolPose from = tick_.state.has_last ? all_.last : tick_.tool;
    memory_.grasp = Vec3(0);
    own_.carrying_count = 0;
    const double angle = angle_between(carried_, from, tick_.tool);
    const int steps = std::clamp(static_cast<int>(std::ceil(angle / kStep)), 1, kMostSteps);
    ToolPose at = from;
    for (int i = 1; i <= steps; ++i) {
      const ToolPose target =
          i == steps ? tick_.tool : between(from, tick_.tool, double(i) / steps);
      planes_.empty() && !stuck_ ? meet(target, at) : step(target, at);
      at = pose_;
      at.tip = target_.tip + placed_.world_vector(at_);
    }
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
    surface_.near_segment(segment.start, segment.along, [&](std::uint32_t index) {
      const stimuli::SurfaceTriangle& t = surface_.triangles()[index];
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

/// Whether a free stylus is out of reach, as far_away() finds first. Most ticks of a trial end
/// here, so that nothing else is set up.
[[gnu::always_inline]] inline bool stylus_is_far(const UnionTick& tick, const PlacedSurface& placed,
                                                 const SurfaceState& own) {
  const Vec3 d = tick.sides ? tick.tool.d : Vec3(0);
  const ToolPose& last_pose = tick.state.has_last ? tick.state.unions.last : tick.tool;
  const Vec3 last_d = tick.sides ? last_pose.d : Vec3(0);
  const Vec3 start = placed.local_point(tick.tool.tip), along = placed.local_vector(d);
  const Vec3 start_before = placed.local_point(last_pose.tip),
             along_before = placed.local_vector(last_d);
  const auto far2 = [](const Vec3& a, const Vec3& a_along, const Vec3& b, const Vec3& b_along) {
    const Vec3 apart = b - a, ends = apart + b_along - a_along;
    return std::max(glm::dot(apart, apart), glm::dot(ends, ends));
  };
  if (own.clear_room > 0) {
    const PosedTool::Segment& clear = own.clear.segments[0];
    if (std::max(far2(clear.start, clear.along, start_before, along_before),
                 far2(clear.start, clear.along, start, along)) < own.clear_room * own.clear_room)
      return true;
  }
  const double step = std::sqrt(far2(start_before, along_before, start, along));
  const Vec3 to = placed.surface->centre() - start;
  const double length2 = glm::dot(along, along);
  const double t = length2 > 0 ? std::clamp(glm::dot(to, along) / length2, 0.0, 1.0) : 0.0;
  const Vec3 apart = to - t * along;
  const double near = placed.surface->radius() + step + 2 * placed.skin;
  return glm::dot(apart, apart) > near * near;
}

void follow_on_surface(UnionTick& tick, std::uint32_t surface) {
  const PlacedSurface& placed = tick.scene.surfaces()[surface];
  const UnionMemory& all = tick.state.unions;
  if (placed.breaking != PlacedSurface::kHolds && all.breaking[placed.breaking].strength == 0)
    return;
  if (!all.groups[placed.group].touching && !(tick.sides && tick.scene.tool() != nullptr) &&
      stylus_is_far(tick, placed, all.surfaces[surface]))
    return;
  SurfaceTool(tick, surface).follow();
}

bool inside_surface(UnionTick& tick, std::uint32_t surface) {
  return SurfaceTool(tick, surface).virtual_inside();
}

/// Of all segments that touch the triangle with the same joint, the patch of the one that lies
/// flattest. Which of them holds the tool depends on how it came; where it touches must not.
SurfacePatch SurfaceTool::flattest(const SurfacePatch& patch) const {
  if (patch.kind != PatchKind::face || turned_.count == 1) return patch;
  const Vec3& normal = surface_.triangles()[patch.triangle()].normal;
  const Vec3 joint = turned_.segments[patch.segment].end(patch.tail);
  SurfacePatch best = patch;
  double least = tick::kSinBlendAngle * tick::kSinBlendAngle;  // steeper ones touch at the joint
  for (std::size_t j = 0; j < turned_.count; ++j) {
    const PosedTool::Segment& segment = turned_.segments[j];
    const double length2 = glm::dot(segment.along, segment.along);
    for (const bool tail : {false, true}) {
      const SurfacePatch other{patch.side, static_cast<std::uint8_t>(j), tail, PatchKind::face};
      const Vec3 apart = segment.end(tail) - joint;
      if (glm::dot(apart, apart) > tolerance_ * tolerance_ || !(length2 > 0)) continue;
      const double slope = glm::dot(normal, segment.along), slope2 = slope * slope / length2;
      // A level segment touches with both ends.
      if (!(slope2 < least) || (slope2 > kLevel * kLevel && !exists(surface_, other, turned_)))
        continue;
      least = slope2;
      best = other;
    }
  }
  return best;
}

void SurfaceTool::add_contact(const SurfacePlane& plane, const Vec3& shift) {
  const SurfacePatch patch = flattest(plane.patch);
  const PosedTool::Segment& segment = turned_.segments[patch.segment];
  const stimuli::SurfaceTriangle& triangle = surface_.triangles()[patch.triangle()];
  PlacedContact& out = all_.contacts.emplace_back();
  LoadedContact& c = out.loaded;
  c.contact.normal = placed_.world_vector(plane.normal);
  c.contact.depth = glm::dot(plane.normal, shift);
  c.normal_displacement = plane.multiplier;
  c.part = placed_.first_material + triangle.shell;
  c.stiffness = tick_.scene.material_of(c.part).stiffness;
  c.force = c.stiffness * plane.multiplier;
  c.object = placed_.of_shell[triangle.shell];
  c.contact.type = ContactType::point_polygon;
  const Vec3 tip = segment.start + shift;
  if (tick_.sides && segment.along != Vec3(0)) {
    c.probe_fraction = patch.tail ? 1 : 0;
    if (patch.kind == PatchKind::edge) {
      c.contact.type = ContactType::segment_edge;
      const std::uint32_t k = stimuli::SurfaceTriangle::side_of(patch.side);
      const Vec3& v0 = surface_.vertices()[triangle.corners[k]];
      const Vec3 e = surface_.vertices()[triangle.corners[(k + 1) % 3]] - v0;
      if (tick_.scene.material_of(c.part).texture != nullptr) {
        out.edge = placed_.world_vector(e);
        out.along = placed_.world_vector(segment.along);
      }
      const Vec3 normal = glm::cross(e, segment.along);
      const double size2 = glm::dot(normal, normal);
      c.probe_fraction =
          size2 > 0 ? std::clamp(glm::dot(glm::cross(tip - v0, e), normal) / size2, 0.0, 1.0) : 0.5;
    }
    double pressed = 0;
    c.probe_fraction =
        place_on(surface_, patch, tip, segment.along, c.probe_fraction, c.contact.type, pressed);
    if (tick_.scene.material_of(c.part).texture != nullptr)
      out.window = placed_.world_vector(
          pressed * (segment.along - glm::dot(segment.along, plane.normal) * plane.normal));
  }
  out.shift = placed_.world_vector(shift);
  const PlacedSegment ideal = place_segment(carried_, tick_.sides, pose_, patch.segment);
  out.place = tick_.tool.tip + out.shift + ideal.from + c.probe_fraction * ideal.along;
  if (tick_.state.has_last) {
    const PlacedSegment now = place_segment(carried_, tick_.sides, tick_.tool, patch.segment);
    const PlacedSegment last = place_segment(carried_, tick_.sides, all_.last, patch.segment);
    out.motion = tick_.tool.tip - all_.last.tip + (now.from + c.probe_fraction * now.along) -
                 (last.from + c.probe_fraction * last.along);
  }
  out.group = group_;
  out.segment = patch.segment;
  out.by_law = true;
}

/// Makes contacts of the planes that hold the tool, without the skin.
void SurfaceTool::add_contacts() {
  Vec3 shift = stuck_ ? at_ : exact_;
  if (planes_.empty() && !stuck_) shift = at_;
  memory_.shift = placed_.world_vector(shift);
  if (stuck_) tick_.faults |= render_fault::kContactCapped;  // it keeps its place
  planes_.for_each_contact(shift, stuck_,
                           [&](const SurfacePlane& plane) { add_contact(plane, shift); });
}

/// Stores the state for the next tick.
void SurfaceTool::remember(std::size_t first_contact) {
  remember_ideal_tool(tick_, group_, pose_, placed_.world_vector(at_), !planes_.empty() || stuck_,
                      first_contact);
  if (!tick_.scene.features().friction) return;
  const PartGroup& group = tick_.scene.groups()[group_];
  for (SurfaceState::Rubbed& slot : own_.rubbed) slot.used = false;
  for (std::size_t i = first_contact; i < all_.contacts.size(); ++i) {
    PlacedContact& c = all_.contacts[i];
    // Continue the friction of the segment's last contact with the most similar normal.
    std::size_t best = 0;
    double most = -HUGE_VAL;
    for (std::size_t k = 0; k < own_.rubbed.size(); ++k) {
      const SurfaceState::Rubbed& slot = own_.rubbed[k];
      if (slot.used) continue;
      const double alike = slot.segment == static_cast<std::uint32_t>(c.segment)
                               ? glm::dot(slot.normal, c.loaded.contact.normal)
                               : -2;
      if (alike <= most) continue;
      most = alike;
      best = k;
    }
    own_.rubbed[best] = {c.loaded.contact.normal, static_cast<std::uint32_t>(c.segment), true};
    c.pair = group.first_pair + static_cast<std::uint32_t>(best);
  }
}

}  // namespace palpate::rendering
