#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/render_fault.h"
#include "rendering/segment_probe.h"
#include "rendering/surface_tool.h"

namespace palpate::rendering {
namespace {

using PatchKind = SurfacePatch::Kind;

constexpr int kMostFaces = 64;      // to each side of a contact
constexpr double kFlat = 1 - 5e-9;  // cosine of 1e-4 rad, by which rounding may bend a flat face

/// Angle of the segment to a triangle, of the blend angle, -1 to 1; 1: its tip dips.
double turned_to(const SurfaceTriangle& triangle, const Vec3& d, double length) {
  const double slope = glm::dot(triangle.normal, d);
  if (slope >= tick::kSinBlendAngle * length) return 1;
  if (slope <= -tick::kSinBlendAngle * length) return -1;
  return std::clamp(tick::small_asin(slope / length) / tick::kBlendAngle, -1.0, 1.0);
}

/// A segment that lies on a surface, from tip to tip + d.
class Lying {
 public:
  Lying(const Surface& surface, const Vec3& tip, const Vec3& d)
      : surface_(surface), tip_(tip), d_(d), length_(glm::length(d)) {}

  struct Crossed {
    tick::Portion portion;
    std::uint32_t next;  ///< side of the triangle beyond
  };

  double turned(std::uint32_t triangle) const {
    return turned_to(surface_.triangles()[triangle], d_, length_);
  }

  /// What of the segment is over a triangle, in its plane, and the side by which it leaves.
  Crossed crossed(std::uint32_t index, bool towards_end) const {
    const SurfaceTriangle& t = surface_.triangles()[index];
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

  /// By how much a triangle and those that follow, towards the end or the beginning, move the point
  /// from `from`. Counts those within the blend angle.
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
      const SurfaceTriangle& beyond = surface_.triangles()[SurfaceTriangle::triangle_of(at.next)];
      // A segment that bridges a hollow touches one side of it alone.
      if (!beyond.touches(SurfaceTriangle::side_of(at.next)) &&
          glm::dot(beyond.normal, surface_.triangles()[triangle].normal) < kFlat)
        break;
      triangle = SurfaceTriangle::triangle_of(at.next);
    }
    return moved;
  }

  double length() const { return length_; }

 private:
  const Surface& surface_;
  Vec3 tip_, d_;
  double length_;
};

/// Where the segment touches: equation (2) over the triangles that it lies along.
/// \param at  of the patch's own contact point on the segment
double place_on(const Surface& surface, const SurfacePatch& patch, const Vec3& tip, const Vec3& d,
                double at, ContactType& type) {
  const Lying lying(surface, tip, d);
  const std::uint32_t left = patch.triangle();
  int along = 0;
  double place = at;
  if (patch.kind == PatchKind::edge) {
    const std::uint32_t right = SurfaceTriangle::triangle_of(
        surface.triangles()[left].across[SurfaceTriangle::side_of(patch.side)]);
    // The triangle that the tip is over faces down along the segment.
    const bool left_ahead = by_tip(surface.triangles()[left], d);
    const std::uint32_t ahead = left_ahead ? left : right, behind = left_ahead ? right : left;
    place += lying.way(ahead, at, true, along);
    place += lying.way(behind, at, false, along);
  } else {
    place += lying.way(left, at, true, along);
    place += lying.way(left, at, false, along);
  }
  if (along == 0) return at;
  type = ContactType::segment_face;
  return std::clamp(place, 0.0, 1.0);
}

}  // namespace

void SurfaceTool::add_contact(const SurfacePlane& plane, const Vec3& shift) {
  const PosedTool::Segment& segment = turned_.segments[plane.patch.segment];
  const SurfaceTriangle& triangle = surface_.triangles()[plane.patch.triangle()];
  const stimuli::Material& material = surface_.materials()[triangle.shell];
  PlacedContact out;
  LoadedContact& c = out.loaded;
  c.contact.normal = placed_.world_vector(plane.normal);
  c.contact.depth = glm::dot(plane.normal, shift);
  c.normal_displacement = plane.multiplier;
  c.stiffness = material.stiffness;
  c.force = c.stiffness * plane.multiplier;
  c.object = placed_.object;
  c.part = placed_.first_material + triangle.shell;
  c.contact.type = ContactType::point_polygon;
  const Vec3 tip = segment.start + shift;
  if (tick_.sides && segment.along != Vec3(0)) {
    c.probe_fraction = plane.patch.tail ? 1 : 0;
    if (plane.patch.kind == PatchKind::edge) {
      c.contact.type = ContactType::segment_edge;
      const std::uint32_t k = SurfaceTriangle::side_of(plane.patch.side);
      const Vec3& v0 = surface_.vertices()[triangle.corners[k]];
      const Vec3 e = surface_.vertices()[triangle.corners[(k + 1) % 3]] - v0;
      const Vec3 normal = glm::cross(e, segment.along);
      const double size2 = glm::dot(normal, normal);
      c.probe_fraction =
          size2 > 0 ? std::clamp(glm::dot(glm::cross(tip - v0, e), normal) / size2, 0.0, 1.0) : 0.5;
    }
    c.probe_fraction =
        place_on(surface_, plane.patch, tip, segment.along, c.probe_fraction, c.contact.type);
  }
  out.shift = placed_.world_vector(shift);
  const PlacedSegment ideal = place_segment(carried_, tick_.sides, pose_, plane.patch.segment);
  out.place = tick_.tool.tip + out.shift + ideal.from + c.probe_fraction * ideal.along;
  if (tick_.state.has_last) {
    const PlacedSegment now = place_segment(carried_, tick_.sides, tick_.tool, plane.patch.segment);
    const PlacedSegment last = place_segment(carried_, tick_.sides, all_.last, plane.patch.segment);
    out.motion = tick_.tool.tip - all_.last.tip + (now.from + c.probe_fraction * now.along) -
                 (last.from + c.probe_fraction * last.along);
  }
  out.group = group_;
  out.segment = plane.patch.segment;
  out.by_law = true;
  all_.contacts.push_back(out);
}

/// Contacts from the planes that hold the tool, without the skin.
void SurfaceTool::add_contacts() {
  Vec3 shift = stuck_ ? at_ : exact_;
  if (planes_.empty() && !stuck_) shift = at_;
  memory_.shift = placed_.world_vector(shift);
  if (stuck_) tick_.faults |= render_fault::kContactCapped;  // it stays where it is
  const double length = glm::length(shift);
  const SurfacePlane* most = planes_.most_loaded();
  if (stuck_ || (most != nullptr && most->multiplier > kMostLeverage * length)) {
    if (most == nullptr || !(length > 0)) return;
    SurfacePlane held = *most;
    held.normal = shift / length;
    held.multiplier = length;
    add_contact(held, shift);
    return;
  }
  for (const SurfacePlane& plane : planes_.all()) {
    if (plane.multiplier > 0) add_contact(plane, shift);
  }
}

/// What the next tick needs.
void SurfaceTool::remember(std::size_t first_contact) {
  // Mostly it has taken the whole turn.
  const bool behind = pose_.d != tick_.tool.d || pose_.frame != tick_.tool.frame;
  const double angle = behind ? angle_between(carried_, pose_, tick_.tool) : 0;
  memory_.touching = !planes_.empty() || stuck_ || angle > 0 || at_ != Vec3(0);
  memory_.ideal = pose_;
  memory_.ideal.tip = tick_.tool.tip + placed_.world_vector(at_);
  memory_.lag = angle;
  if (angle > all_.most_lag) {
    all_.most_lag = angle;
    all_.most_behind = group_;
  }
  all_.exceptions |= angle > kMostLag;
  const double size = carried_ != nullptr ? tick_.scene.tool_reach() : glm::length(pose_.d);
  all_.reach = std::max(all_.reach, glm::length(at_) + angle * size);
  // The mean contact place, about which the tool turns at the next tick.
  Vec3 grasp(0);
  double weight = 0;
  const PartGroup& group = tick_.scene.groups()[group_];
  for (SurfaceState::Rubbed& slot : own_.rubbed) slot.used = false;
  for (std::size_t i = first_contact; i < all_.contacts.size(); ++i) {
    PlacedContact& c = all_.contacts[i];
    const double share = c.loaded.normal_displacement;
    weight += share;
    grasp += share * (carried_ != nullptr
                          ? glm::transpose(pose_.frame) * (c.place - c.shift - tick_.tool.tip)
                          : Vec3(0, 0, c.loaded.probe_fraction));
    // Its friction goes on where the last contact of the segment had about the same normal.
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
  if (weight > 0) memory_.grasp = grasp / weight;
}

}  // namespace palpate::rendering
