#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/equivalent_point.h"
#include "rendering/ideal_tool.h"
#include "rendering/render_fault.h"
#include "rendering/segment_probe.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

}  // namespace

/// Equation (2) over all faces that the segment lies along, of the part that carries it and of
/// those that abut.
/// \param tip  of the ideal segment, frame of the part that carries it
void IdealTool::spread_over_parts(const NearPair& carrying, const WalkResult& hit, const Vec3& tip,
                                  LoadedContact& c) {
  const ScenePart& part = pairs_.part_of(carrying);
  const Vec3 world_tip = part.world_vector(tip) + part.position;
  std::array<FacedPart, kMostFacedParts> faced;
  std::size_t count = 0;
  faced[count++] = {&part, hit.feature, tip, carrying.true_d};
  for (const NearPair& other : pairs_.all()) {
    if (other.segment != carrying.segment || other.part == carrying.part) continue;
    if (count == faced.size()) break;
    const ScenePart& beside = pairs_.part_of(other);
    faced[count++] = {&beside, pairs_.state_of(other).feature, beside.local_point(world_tip),
                      other.true_d};
  }
  spread_over_faces(std::span<const FacedPart>(faced.data(), count), hit, kAbutting * group_.skin,
                    c);
}

void IdealTool::add_contact(const Plane& plane, const Vec3& shift) {
  const NearPair& near = pairs_[plane.near];
  const ScenePart& part = pairs_.part_of(near);
  const PlacedSegment& segment = pairs_.oriented().segments[near.segment];
  PlacedContact out;
  LoadedContact& c = out.loaded;
  c.contact.normal = plane.normal;
  c.contact.depth = glm::dot(plane.normal, shift);
  c.normal_displacement = plane.multiplier;
  c.stiffness = part.material.stiffness;
  c.force = c.stiffness * plane.multiplier;
  c.object = part.object;
  c.part = near.part;
  const Vec3 tip = near.true_tip + part.local_vector(shift);
  WalkResult at = measure(*part.mesh, plane.feature, tip, near.true_d);
  at.feature = plane.feature;
  if (tick_.sides) {
    const double length = glm::length(near.true_d);
    tick::SegmentProbe::classify(*part.mesh, at, tip, near.true_d, length, c);
    if (c.contact.type != ContactType::segment_face)
      place_along_border(*part.mesh, at, tip, near.true_d, length, kAbutting * group_.skin, c);
    if (part.shallow_ridges || c.contact.type == ContactType::segment_face)
      spread_over_parts(near, at, tip, c);
  } else {
    c.contact.type = ContactType::point_polygon;
  }
  out.shift = shift;
  const Vec3 on_tool = segment.from + c.probe_fraction * segment.along;
  out.place = tick_.tool.tip + shift + on_tool;
  if (tick_.state.has_last) {
    const PlacedSegment now = pairs_.now().segments[near.segment];
    const PlacedSegment last = pairs_.placed(all_.last, near.segment);
    out.motion = tick_.tool.tip - all_.last.tip + (now.from + c.probe_fraction * now.along) -
                 (last.from + c.probe_fraction * last.along);
  }
  out.group = index_;
  out.pair = near.pair;
  out.segment = static_cast<int>(near.segment);
  out.by_law = true;
  all_.contacts.push_back(out);
}

/// Contacts from the planes that hold the tool, without the skin.
void IdealTool::add_contacts() {
  Vec3& shift = memory_.shift;
  shift = stuck_ ? at_ : exact_;
  if (stuck_) tick_.faults |= render_fault::kContactCapped;  // it stays where it is
  const double length = glm::length(shift);
  const Plane* most = planes_.most_loaded();
  if (stuck_ || (most != nullptr && most->multiplier > kMostLeverage * length)) {
    if (most == nullptr || !(length > 0)) return;
    Plane held = *most;
    held.normal = shift / length;
    held.multiplier = length;
    add_contact(held, shift);
    return;
  }
  for (const Plane& plane : planes_.all()) {
    if (plane.multiplier > 0) add_contact(plane, shift);
  }
}

/// What separates the pairs that do not hold the tool.
void IdealTool::remember_planes() {
  for (const NearPair& near : pairs_.all()) {
    PairState& state = pairs_.state_of(near);
    state.carries = near.carries;
    // What the next tick may step to is on its way here by then.
    if (!(state.feature == near.came_with) && pairs_.part_of(near).trees->facet_map() != nullptr)
      prefetch_neighbours(*pairs_.part_of(near).mesh, state.feature);
    if (near.carries) state.plane.valid = false;
    if (near.carries || state.feature.kind == Kind::none) continue;
    if (near.has_plane && !near.was_cast) continue;
    const ScenePart& part = pairs_.part_of(near);
    const Vec3 tip = near.true_tip + part.local_vector(at_);
    const WalkResult at = measure(*part.mesh, state.feature, tip, near.true_d);
    const double lower = std::min(glm::dot(at.normal, tip), glm::dot(at.normal, tip + near.true_d));
    state.plane = {at.normal, lower + at.depth, at.depth < 0};
  }
}

/// The mean contact place, about which the tool turns at the next tick.
void IdealTool::remember_grasp(std::size_t first_contact) {
  Vec3 grasp(0);
  double weight = 0;
  for (std::size_t i = first_contact; i < all_.contacts.size(); ++i) {
    const PlacedContact& c = all_.contacts[i];
    const double share = c.loaded.normal_displacement;
    weight += share;
    grasp += share * (carried_ != nullptr
                          ? glm::transpose(pose_.frame) * (c.place - c.shift - tick_.tool.tip)
                          : Vec3(0, 0, c.loaded.probe_fraction));
  }
  if (weight > 0) memory_.grasp = grasp / weight;
}

/// What the next tick needs.
void IdealTool::remember(std::size_t first_contact) {
  remember_planes();
  // Mostly it has taken the whole turn.
  const bool behind = pose_.d != tick_.tool.d || pose_.frame != tick_.tool.frame;
  const double angle = behind ? angle_between(carried_, pose_, tick_.tool) : 0;
  memory_.touching = !planes_.empty() || stuck_ || angle > 0 || at_ != Vec3(0);
  memory_.ideal = pose_;
  memory_.ideal.tip = tick_.tool.tip + at_;
  memory_.lag = angle;
  if (angle > all_.most_lag) {
    all_.most_lag = angle;
    all_.most_behind = index_;
  }
  all_.exceptions |= angle > kMostLag;
  const double size = carried_ != nullptr ? tick_.scene.tool_reach() : glm::length(pose_.d);
  all_.reach = std::max(all_.reach, glm::length(at_) + angle * size);
  remember_grasp(first_contact);
}

}  // namespace palpate::rendering
