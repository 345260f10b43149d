#include "rendering/union_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/active_planes.h"
#include "rendering/equivalent_point.h"
#include "rendering/near_pairs.h"
#include "rendering/probes.h"
#include "rendering/render_fault.h"
#include "rendering/surface_contact.h"
#include "rendering/union_state.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

// One ideal tool in one tick: it turns, translates and reports where it touches. Internal to
// the contact law of unions (union_contact.h). World frame, SI units.

/// Faces abut if they are closer to each other than this many skins.
inline constexpr double kAbutting = 4;

/// The ideal tool of one group, in one tick. Translations are relative to the virtual tool's tip.
class IdealTool {
 public:
  IdealTool(UnionTick& tick, std::uint32_t group_index)
      : tick_(tick),
        all_(tick.state.unions),
        index_(group_index),
        group_(tick.scene.groups()[group_index]),
        memory_(all_.groups[group_index]),
        pairs_(tick, group_),
        carried_(pairs_.carried()) {}

  void follow();

 private:
  /// m, from the tip to a point fixed to the tool; `grasp` as in GroupState.
  Vec3 turned(const Vec3& grasp, const ToolPose& pose) const {
    return carried_ != nullptr ? pose.frame * grasp : grasp.z * pose.d;
  }
  Plane plane_of(std::uint32_t near, ContactFeature feature) const;

  // union_contact.cpp
  ToolPose first_contact(const ToolPose& from, bool& entered);

  // Turning.
  double turn(const ToolPose& from, double most);
  bool settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
              double most_push);
  bool push_out(const Vec3& from, double most_push);
  bool put_plane(std::uint32_t near, ContactFeature feature);

  // Translating.
  void resume_planes();
  void translate();
  bool find_goal(Vec3& goal);
  bool next_hit(const Vec3& goal, std::uint32_t& near, PairCast& first);
  void move_to_hit(const Vec3& goal, std::uint32_t near, const PairCast& hit);
  bool find_exact_place();
  bool in_the_way_at_rest(Plane& plane);
  void take_plane(const Plane& plane);
  void release_idle_planes();
  bool release_slid_planes(bool at_rest);
  bool slid_off(const Plane& plane) const;
  bool slide_on(Plane& plane);
  bool slid_off_at_rest(const Plane& plane, double slack) const;
  bool past_a_facet_at_rest() const;
  bool parted_here(const NearPair& near) const;

  // Contacts.
  void add_contacts();
  const NearPair& flattest(const Plane& plane);
  void add_contact(const Plane& plane, const Vec3& shift);
  void spread_over_parts(const NearPair& carrying, const WalkResult& hit, const Vec3& tip,
                         LoadedContact& c);
  void remember(std::size_t first_contact);
  void remember_planes();

  UnionTick& tick_;
  UnionMemory& all_;
  std::uint32_t index_;
  const PartGroup& group_;
  GroupState& memory_;
  NearPairs pairs_;
  const Tool* carried_;
  ToolPose pose_;  ///< its orientation; the tip is the virtual one plus at_
  Vec3 at_;        ///< m, from the virtual tip to the ideal one, a skin off its contacts
  Vec3 exact_;     ///< m, the same without the skin, once it rests
  Planes planes_;
  bool stuck_ = false;
  bool in_crack_ = false;  ///< opposite planes leave the tool less than a skin
};

using Kind = ContactFeature::Kind;

/// Applies equation (2) over all faces that the segment lies along: those of the part that carries
/// it and those of abutting parts.
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

/// Of all segments that touch the part's facet with the same joint, the pair of the one that lies
/// flattest. Which of them holds the tool depends on how it came; where it touches must not.
const NearPair& IdealTool::flattest(const Plane& plane) {
  constexpr double kLevel = 1e-12;  // sine
  const NearPair& held = pairs_[plane.near];
  if (plane.feature.kind != Kind::facet || pairs_.oriented().count < 2) return held;
  const ScenePart& part = pairs_.part_of(held);
  const Vec3& normal = part.mesh->facets()[plane.feature.index].normal;
  const auto deeper_end = [&](const NearPair& near) {
    return glm::dot(normal, near.true_d) < 0 ? near.true_tip + near.true_d : near.true_tip;
  };
  const Vec3 joint = deeper_end(held);
  const NearPair* best = &held;
  double least = tick::kSinBlendAngle * tick::kSinBlendAngle;  // steeper ones touch at the joint
  for (const NearPair& near : pairs_.all()) {
    const double length2 = glm::dot(near.true_d, near.true_d);
    if (near.part != held.part || !(length2 > 0)) continue;
    const double slope = glm::dot(normal, near.true_d), slope2 = slope * slope / length2;
    const auto is_joint = [&](const Vec3& end) {
      return glm::distance(end, joint) <= part.tolerance;
    };
    // A level segment touches with both ends.
    const bool touches = is_joint(deeper_end(near)) ||
                         (slope2 <= kLevel * kLevel &&
                          (is_joint(near.true_tip) || is_joint(near.true_tip + near.true_d)));
    if (!touches || !(slope2 < least)) continue;
    least = slope2;
    best = &near;
  }
  return *best;
}

void IdealTool::add_contact(const Plane& plane, const Vec3& shift) {
  const NearPair& near = flattest(plane);
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
  if (part.material.texture != nullptr) {
    if (plane.feature.kind == Kind::edge && tick_.sides) {
      const stimuli::Edge& edge = part.mesh->edges()[plane.feature.index];
      out.edge = part.world_vector(edge.to - edge.from);
      out.along = segment.along;
    }
    if (c.contact.type == ContactType::segment_face) {
      at.depth = 0;  // of the ideal tool
      out.window = part.world_vector(
          tick::pressed_window(*part.mesh, at, tip, near.true_d, c.probe_fraction));
    }
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
  planes_.for_each_contact(shift, stuck_, [&](const Plane& plane) { add_contact(plane, shift); });
}

/// Remembers the planes that separate the pairs that do not hold the tool.
void IdealTool::remember_planes() {
  for (const NearPair& near : pairs_.all()) {
    PairState& state = pairs_.state_of(near);
    state.carries = near.carries;
    // Prefetch the facets that the next tick may step to.
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

/// Remembers the state that the next tick needs.
void IdealTool::remember(std::size_t first_contact) {
  remember_planes();
  remember_ideal_tool(tick_, index_, pose_, at_, !planes_.empty() || stuck_, first_contact);
}

constexpr int kRounds = 96;         // of casts in one tick; then the ideal tool stays where it is
constexpr double kSlidOff = 4;      // skins; a contact farther off its facet has left it
constexpr double kOnFacet = 1e-11;  // of the size, added to that for thin skins
constexpr double kSkinAtRest = 2e-12;  // of the size: the same without the skin
constexpr double kExact = 1e-5;        // of the skin; smaller distances are rounding
constexpr double kRounding = 0.125;    // of the skin; tolerance in keeping it
constexpr double kLessSkin = 0.25;     // factor on the skin where two do not fit, repeated
constexpr double kInTheWay = 0.25;     // of a part's tolerance; a deeper tool at rest is held
constexpr double kSamePlace = 8;       // skins; within it a contact that comes back never left

/// Resumes the planes that held the tool at the last tick if it is still beyond them.
void IdealTool::resume_planes() {
  planes_.remove_if([](const Plane& plane) { return plane.multiplier <= 0; });
  for (NearPair& near : pairs_.all()) near.carries = false;
  for (const Plane& plane : planes_.all()) pairs_[plane.near].carries = true;
  for (std::uint32_t i = 0; i < pairs_.size() && !planes_.full(); ++i) {
    NearPair& near = pairs_[i];
    if (!pairs_.state_of(near).carries || near.carries) continue;
    const Plane plane = plane_of(i, pairs_.state_of(near).feature);
    if (!(glm::dot(plane.normal, at_) - plane.depth > 0)) continue;
    near.carries = true;
    planes_.add(plane);
  }
}

/// The first part on the straight way to `goal`.
bool IdealTool::next_hit(const Vec3& goal, std::uint32_t& hit, PairCast& first) {
  first.time = 2;
  const Vec3 way = goal - at_;
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    NearPair& near = pairs_[i];
    if (near.carries) continue;  // convex, and behind a plane that the way does not cross
    if (apart(near, at_, goal) ||
        pairs_.part_by_sphere(near, pairs_.posed(near, at_), pairs_.posed(near, goal)))
      continue;
    near.was_cast = true;
    const PairCast found =
        cast(pairs_.mesh_of(near), pairs_.state_of(near).feature, pairs_.local(near, at_), near.d,
             pairs_.part_of(near).shrink * pairs_.part_of(near).local_vector(way));
    pairs_.state_of(near).feature = found.feature;
    if (!found.hit || !(found.time < first.time)) continue;
    // The tool is inside within rounding, and the way leads out. A plane would hold nothing; where
    // there is no room for it, others that hold nothing would make room and be hit again.
    if (planes_.full() && found.time == 0 && glm::dot(plane_of(i, found.feature).normal, way) > 0)
      continue;
    first = found;
    hit = i;
  }
  return first.time <= 1;
}

/// Whether the tool, moving and a skin away, is past the facet.
bool IdealTool::slid_off(const Plane& plane) const {
  const NearPair& near = pairs_[plane.near];
  const stimuli::ConvexMesh& mesh = *pairs_.part_of(near).mesh;
  const double slack = kSlidOff * group_.skin + kOnFacet * (mesh.size() + glm::length(near.d));
  return distance_off(mesh, plane.feature, pairs_.local(near, at_), near.d) > slack;
}

/// The same for the tool at rest, without the skin.
/// \param slack  of the size; smaller distances are rounding
bool IdealTool::slid_off_at_rest(const Plane& plane, double slack) const {
  const NearPair& near = pairs_[plane.near];
  const ScenePart& part = pairs_.part_of(near);
  slack *= part.mesh->size() + glm::length(near.true_d);
  const Vec3 tip = near.true_tip + part.local_vector(exact_);
  return distance_off(*part.mesh, plane.feature, tip, near.true_d) > slack;
}

/// Replaces the plane by that of the next facet of M if the tool, a skin away, is over that facet.
/// Moving to the place where the new plane holds the tool crosses nothing: the way stays outside
/// of that plane.
bool IdealTool::slide_on(Plane& plane) {
  const NearPair& near = pairs_[plane.near];
  const ContactFeature next =
      feature_beyond(*pairs_.part_of(near).mesh, plane.feature, pairs_.local(near, at_), near.d);
  if (next.kind == Kind::none) return false;
  Plane beyond = plane_of(plane.near, next);
  if (!(glm::dot(beyond.normal, at_) - beyond.depth > 0) || slid_off(beyond)) return false;
  beyond.stays = true;
  plane = beyond;
  pairs_.state_of(near).feature = beyond.feature;
  return true;
}

/// Whether the pair released the ideal tool at its present place, within rounding.
bool IdealTool::parted_here(const NearPair& near) const {
  const double same = kSamePlace * group_.skin;
  const Vec3 apart = at_ - near.parted_at;
  return near.parted && glm::dot(apart, apart) <= same * same;
}

/// Releases planes that hold nothing.
void IdealTool::release_idle_planes() {
  planes_.remove_if([&](const Plane& plane) {
    if (plane.multiplier > 0) return false;
    pairs_[plane.near].carries = false;
    return true;
  });
}

/// Releases planes whose facet the tool has slid off. True if there are any.
bool IdealTool::release_slid_planes(bool at_rest) {
  bool slid = false;
  planes_.remove_if([&](Plane& plane) {
    NearPair& near = pairs_[plane.near];
    if (plane.stays && parted_here(near)) return false;
    if (!(at_rest ? slid_off_at_rest(plane, kSkinAtRest) : slid_off(plane))) return false;
    near.parted = true;
    near.parted_at = at_;
    slid = true;
    if (slide_on(plane)) return false;
    near.carries = false;
    return true;
  });
  return slid;
}

/// Finds where the tool rests without the skin; sets the multipliers. False if rounding hides it.
bool IdealTool::find_exact_place() {
  return planes_.nearest(Vec3(0), 0, kExact * group_.skin, exact_) ||
         planes_.nearest(Vec3(0), 0, kRounding * group_.skin, exact_);
}

/// Whether the tool, without the skin, is past one of the facets that hold it a skin away. The
/// facets of a groove may end between the two places and leave a gap that is too narrow for the
/// skin.
bool IdealTool::past_a_facet_at_rest() const {
  const std::span<const Plane> all = planes_.all();
  const auto past = [&](const Plane& plane) {
    return plane.stays && plane.multiplier > 0 && slid_off_at_rest(plane, kOnFacet);
  };
  const auto off = [&](const Plane& plane) { return plane.multiplier > 0 && slid_off(plane); };
  return std::any_of(all.begin(), all.end(), past) && std::none_of(all.begin(), all.end(), off);
}

/// Whether the tool, without the skin, is inside another part that it was less than a skin away
/// from. If so, sets the plane that keeps it out.
bool IdealTool::in_the_way_at_rest(Plane& plane) {
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    const NearPair& near = pairs_[i];
    if (near.carries || apart(near, exact_, exact_)) continue;
    const ScenePart& part = pairs_.part_of(near);
    const ContactFeature known = pairs_.state_of(near).feature;
    const Vec3 rest = part.local_vector(exact_), skin = part.local_vector(exact_ - at_);
    if (known.kind != Kind::none &&
        measure(*part.mesh, known, near.true_tip + rest, near.true_d).depth < 0)
      continue;
    const PairCast in =
        cast(pairs_.mesh_of(near), known, near.true_tip + rest - skin, near.true_d, skin);
    if (!in.hit) continue;
    plane = plane_of(i, in.feature);
    if (!(plane.depth - glm::dot(plane.normal, exact_) > kInTheWay * part.tolerance)) continue;
    if (plane.depth - glm::dot(plane.normal, at_) < group_.skin) return true;
  }
  return false;
}

/// Puts a plane in use; its pair has no other in use.
void IdealTool::take_plane(const Plane& plane) {
  if (planes_.full()) release_idle_planes();
  stuck_ = planes_.full();
  if (stuck_) return;
  NearPair& near = pairs_[plane.near];
  near.carries = true;
  pairs_.state_of(near).feature = plane.feature;
  planes_.add(plane);
}

void IdealTool::move_to_hit(const Vec3& goal, std::uint32_t index, const PairCast& hit) {
  Plane plane = plane_of(index, hit.feature);
  // Stop a skin before the plane.
  const Vec3 way = goal - at_;
  const double rate = glm::dot(plane.normal, way);
  const double height = glm::dot(plane.normal, at_) - plane.depth;
  const double time = rate < 0 ? std::clamp((height - group_.skin) / -rate, 0.0, hit.time) : 0.0;
  at_ += time * way;
  if (time * glm::length(way) > kSamePlace * group_.skin) {
    release_idle_planes();
    release_slid_planes(false);
  }
  plane.stays = parted_here(pairs_[index]);
  take_plane(plane);
}

/// Finds the point nearest to the virtual tool, a skin off the planes. In a gap narrower than two
/// skins the tool keeps a share of the skin, or else its present distances. False if rounding hides
/// the point.
bool IdealTool::find_goal(Vec3& goal) {
  const double skin = group_.skin;
  in_crack_ = false;
  if (planes_.nearest(Vec3(0), skin, kRounding * skin, goal)) return true;
  in_crack_ = planes_.are_a_crack();
  for (double less = kLessSkin * skin; less >= kExact * skin; less *= kLessSkin) {
    if (planes_.nearest(Vec3(0), less, kRounding * less, goal)) return true;
  }
  return planes_.nearest_from(at_, skin, kRounding * skin, kExact * skin, goal);
}

/// Moves the ideal tool as near to the virtual one as the parts allow.
void IdealTool::translate() {
  for (int round = 0; round < kRounds && !stuck_; ++round) {
    Vec3 goal;
    if (!find_goal(goal)) break;
    std::uint32_t near = 0;
    PairCast hit;
    if (next_hit(goal, near, hit)) {
      move_to_hit(goal, near, hit);
      continue;
    }
    at_ = goal;
    release_idle_planes();
    if (!find_exact_place()) break;
    if (release_slid_planes(true)) continue;
    if (past_a_facet_at_rest() && !find_goal(exact_)) break;  // the gap is closed to it
    Plane in_the_way;
    if (!in_the_way_at_rest(in_the_way)) return;
    take_plane(in_the_way);
  }
  stuck_ = true;
}

constexpr int kPushRounds = 12;          // to leave parts that a turn brought the tool into
constexpr double kLeastTurn = 1.0 / 16;  // of a turn; less waits for the next tick
constexpr double kFarPush = 8;           // times the turn's own motion; a longer push fails

/// Puts the plane of a pair in use and replaces the pair's previous one. False if there is no room.
bool IdealTool::put_plane(std::uint32_t index, ContactFeature feature) {
  const Plane plane = plane_of(index, feature);
  pairs_.state_of(pairs_[index]).feature = plane.feature;
  for (Plane& old : planes_.all()) {
    if (old.near != index) continue;
    old = plane;
    return true;
  }
  if (planes_.full()) return false;
  pairs_[index].carries = true;
  planes_.add(plane);
  return true;
}

/// Turns the ideal tool as the virtual one has turned, about where it touches, as far as the parts
/// allow.
/// \param most  share of the turn to try
/// \return the share taken, 0 to 1
double IdealTool::turn(const ToolPose& from, double most) {
  PlacedTool& before = all_.before;
  pairs_.place(from, before);
  const PlacedTool& after = pairs_.now();
  const Vec3 shift = turned(memory_.grasp, from) - turned(memory_.grasp, tick_.tool);
  double motion = 0;
  for (std::size_t j = 0; j < before.count; ++j) {
    const Vec3 start = after.segments[j].from - before.segments[j].from + shift;
    motion = std::max({motion, glm::length(start),
                       glm::length(start + after.segments[j].along - before.segments[j].along)});
  }
  const double far = kFarPush * motion + 4 * group_.skin;
  const double reach =
      glm::length(from.tip - tick_.tool.tip) + glm::length(shift) + 2 * motion + far;
  pairs_.collect(from, before, reach, reach);
  if (motion == 0) {
    pose_ = tick_.tool;
    at_ = from.tip - tick_.tool.tip;
    pairs_.orient(before);
    return 0;
  }
  for (double fraction = most; fraction >= kLeastTurn; fraction *= 0.5) {
    ToolPose to = fraction == 1 ? tick_.tool : between(from, tick_.tool, fraction);
    to.tip = from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to);
    if (fraction < 1) pairs_.place(to, all_.turned);
    pairs_.orient(fraction == 1 ? after : all_.turned);
    if (settle(from, before, to, far)) {
      pose_ = to;
      return fraction;
    }
  }
  pose_ = from;
  at_ = from.tip - tick_.tool.tip;
  planes_.clear();
  pairs_.orient(before);
  return 0;
}

/// Moves a turned, oriented tool out of all parts near it. False if it finds no such place.
bool IdealTool::settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
                       double most_push) {
  planes_.clear();
  for (NearPair& near : pairs_.all()) near.carries = false;
  at_ = to.tip - tick_.tool.tip;
  for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
    NearPair& near = pairs_[i];
    PairState& state = pairs_.state_of(near);
    ContactFeature start = state.feature;
    const Vec3 tip = pairs_.local(near, at_);
    if (!state.carries) {
      if (near.was_apart && apart(near, at_, at_)) continue;
      if (pairs_.part_by_sphere(near, NearPairs::posed(near, from.tip, placed_from),
                                pairs_.posed(near, at_)))
        continue;
      near.was_cast = true;
      const Entry entry =
          pairs_.sweep(near, pairs_.shrunk(near, from.tip, placed_from.segments[near.segment]),
                       {tip, tip + near.d});
      if (!entry.entered) continue;
      start = entry.feature;
    }
    const WalkResult at = locate(pairs_.mesh_of(near), start, tip, near.d);
    if (at.feature.kind != Kind::none && !put_plane(i, at.feature)) return false;
  }
  return planes_.empty() || push_out(at_, most_push);
}

/// Moves the tool out of the parts whose planes are in use and of those that it enters on the way.
bool IdealTool::push_out(const Vec3& from, double most_push) {
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.nearest(from, group_.skin, group_.skin / 8, at_)) return false;
    const Vec3 moved = at_ - from;
    if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    bool out = true;
    for (std::uint32_t i = 0; i < pairs_.size(); ++i) {
      NearPair& near = pairs_[i];
      ContactFeature inside;
      if (near.carries) {
        inside = locate(pairs_.mesh_of(near), pairs_.state_of(near).feature,
                        pairs_.local(near, at_), near.d)
                     .feature;
      } else {
        if (apart(near, from, at_) ||
            pairs_.part_by_sphere(near, pairs_.posed(near, from), pairs_.posed(near, at_)))
          continue;
        near.was_cast = true;
        const PairCast hit =
            cast(pairs_.mesh_of(near), pairs_.state_of(near).feature, pairs_.local(near, from),
                 near.d, pairs_.part_of(near).shrink * pairs_.part_of(near).local_vector(moved));
        pairs_.state_of(near).feature = hit.feature;
        if (hit.hit) inside = hit.feature;
      }
      if (inside.kind == Kind::none) continue;
      out = false;
      if (!put_plane(i, inside)) return false;
    }
    if (out) return true;
  }
  return false;
}

/// Where no contact has force, show an ideal tool that lags behind in turning: the virtual one may
/// be inside a part.
void show_behind(const UnionMemory& all, bool tool, const Vec3& tip, Rendering& out) {
  if (!(all.most_lag > 0)) return;
  const GroupState& group = all.groups[all.most_behind];
  out.ideal.tip = tip + group.shift;
  out.ideal.tail = out.ideal.tip + group.ideal.d;
  if (tool) out.ideal_side = group.ideal.frame[0];
}

/// m, the farthest that any point of the tool moves from one pose to another.
double motion_of(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
                 const PlacedTool& placed_to) {
  double most = 0;
  for (std::size_t j = 0; j < placed_to.count; ++j) {
    const Vec3 start =
        to.tip + placed_to.segments[j].from - from.tip - placed_from.segments[j].from;
    most = std::max(
        {most, glm::length(start),
         glm::length(start + placed_to.segments[j].along - placed_from.segments[j].along)});
  }
  return most;
}

/// The pose at which a tool that comes from free space meets the first part; the virtual pose if it
/// meets none.
ToolPose IdealTool::first_contact(const ToolPose& from, bool& entered) {
  PlacedTool& before = all_.before;
  pairs_.place(from, before);
  const PlacedTool& after = pairs_.now();
  pairs_.collect(from, before, motion_of(from, before, tick_.tool, after), 0);
  Entry first;
  const NearPair* at = nullptr;
  for (NearPair& near : pairs_.all()) {
    const Entry entry =
        pairs_.sweep(near, pairs_.shrunk(near, from.tip, before.segments[near.segment]),
                     pairs_.shrunk(near, tick_.tool.tip, after.segments[near.segment]));
    if (!entry.entered) continue;
    pairs_.state_of(near).feature = entry.feature;
    if (entry.time >= first.time) continue;
    first = entry;
    at = &near;
  }
  entered = at != nullptr;
  if (!entered) return tick_.tool;
  ToolPose pose = between(from, tick_.tool, first.time);
  // The rest of the turn is about the contact.
  const PlacedSegment segment = pairs_.placed(pose, at->segment);
  const LineProbe local = pairs_.shrunk(*at, pose.tip, segment);
  const WalkResult contact =
      measure(*pairs_.part_of(*at).mesh, first.feature, local.tip, local.tail - local.tip);
  const Vec3 grasp = segment.from + contact.probe_fraction * segment.along;
  memory_.grasp =
      carried_ != nullptr ? glm::transpose(pose.frame) * grasp : Vec3(0, 0, contact.probe_fraction);
  return pose;
}

Plane IdealTool::plane_of(std::uint32_t index, ContactFeature feature) const {
  const NearPair& near = pairs_[index];
  const ScenePart& part = pairs_.part_of(near);
  const WalkResult at = measure(*part.mesh, feature, near.true_tip, near.true_d);
  Plane plane;
  plane.near = index;
  plane.feature =
      at.feature.kind != ContactFeature::Kind::none ? at.feature : at.separating_feature;
  plane.normal = part.world_vector(at.normal);
  plane.depth = at.depth;
  return plane;
}

void IdealTool::follow() {
  ToolPose from = memory_.ideal;
  if (!memory_.touching) {
    bool entered = false;
    from = first_contact(tick_.state.has_last ? all_.last : tick_.tool, entered);
    if (!entered) return;
  }
  // Halve a turn that leads into a crack or finds no rest.
  double most = 1;
  do {
    most = 0.5 * turn(from, most);
    stuck_ = false;
    resume_planes();
    translate();
  } while (most > 0 && (stuck_ || in_crack_ || !planes_.leave_room()));
  const std::size_t first_contact = all_.contacts.size();
  add_contacts();
  remember(first_contact);
}

/// Forgets the contacts with the k-th part of a group.
void forget_part(UnionTick& tick, const PartGroup& group, std::size_t k) {
  const std::size_t segments = tick.scene.segments();
  for (std::size_t j = 0; j < segments; ++j) {
    PairState& pair = tick.state.unions.pairs[group.first_pair + k * segments + j];
    pair.carries = false;
    pair.plane.valid = false;
    pair.friction = {};
  }
}

/// Forgets the contacts of the group's ideal tool: from now on it is the virtual one.
void forget_contacts(UnionTick& tick, std::uint32_t index) {
  const PartGroup& group = tick.scene.groups()[index];
  tick.state.unions.groups[index].touching = false;
  tick.state.unions.groups[index].lag = 0;
  if (group.surface != PartGroup::kParts)
    tick.state.unions.surfaces[group.surface].carrying_count = 0;
  for (std::size_t k = 0; k < group.part_count; ++k) forget_part(tick, group, k);
}

/// Whether the virtual tool is outside of the surface and all layers of an object.
bool left(UnionTick& tick, std::uint32_t object) {
  for (std::uint32_t i = 0; i < tick.scene.groups().size(); ++i) {
    const PartGroup& group = tick.scene.groups()[i];
    if (!group.by_law || group.object_state != object) continue;
    if (group.surface != PartGroup::kParts ? inside_surface(tick, group.surface)
                                           : inside_group(tick, i))
      return false;
  }
  return true;
}

void restore(UnionTick& tick, std::size_t breaking) {
  UnionMemory& all = tick.state.unions;
  GroupState& group = all.groups[tick.scene.breaking()[breaking].group];
  all.breaking[breaking] = {};
  group.strength = 1;
  group.parts_went = false;
}

void restore_layers(UnionTick& tick, std::uint32_t object) {
  for (std::size_t i = 0; i < tick.scene.breaking().size(); ++i) {
    if (tick.scene.breaking()[i].object_state == object) restore(tick, i);
  }
}

void switch_off(UnionTick& tick, std::uint32_t object) {
  tick.state.unions.objects[object].off = true;
  for (std::uint32_t i = 0; i < tick.scene.groups().size(); ++i) {
    if (tick.scene.groups()[i].object_state == object) forget_contacts(tick, i);
  }
}

/// s; 1 ms where the clock does not run.
double step_of(const UnionTick& tick) { return tick.dt > 0 ? tick.dt : 1e-3; }

void release_hooked(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (ObjectState& object : all.objects) object.lag = 0;
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    double& lag = all.objects[tick.scene.groups()[g].object_state].lag;
    lag = std::max(lag, all.groups[g].lag);
  }
  for (ObjectState& object : all.objects) {
    object.lagging = object.lag > kMostLag ? object.lagging + step_of(tick) : 0;
    if (object.lagging > kMostLagTime) object.releasing = true;
    if (!object.releasing) continue;
    tick.faults |= render_fault::kReleased;
    object.strength = std::max(0.0, object.strength - step_of(tick) / kFadeTime);
  }
}

/// Null: the contact's part or surface never breaks.
BreakState* breaking_of(UnionTick& tick, const PlacedContact& contact) {
  static_assert(ScenePart::kHolds == PlacedSurface::kHolds);
  const std::uint32_t surface = tick.scene.groups()[contact.group].surface;
  const std::uint32_t index = surface != PartGroup::kParts
                                  ? tick.scene.surfaces()[surface].breaking
                                  : tick.scene.parts()[contact.loaded.part].breaking;
  return index == ScenePart::kHolds ? nullptr : &tick.state.unions.breaking[index];
}

/// Parts whose force has faded no longer hold the ideal tool.
void remove_parts(UnionTick& tick, std::uint32_t breaking) {
  const std::uint32_t index = tick.scene.breaking()[breaking].group;
  const PartGroup& group = tick.scene.groups()[index];
  if (group.surface != PartGroup::kParts) forget_contacts(tick, index);
  for (std::uint32_t k = 0; k < group.part_count; ++k) {
    if (tick.scene.parts()[group.first_part + k].breaking == breaking) forget_part(tick, group, k);
  }
  tick.state.unions.groups[index].parts_went = true;
}

/// N, without friction.
Vec3 force_of(const UnionMemory& all, std::uint32_t group) {
  Vec3 force(0);
  for (const PlacedContact& c : all.contacts) {
    if (c.group == group) force += c.loaded.force * c.loaded.contact.normal;
  }
  return force;
}

/// When parts of a layer have gone, their neighbours' force rises smoothly: the tool may be deep in
/// them by then.
void raise_forces(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    GroupState& group = all.groups[g];
    if (!group.parts_went && group.strength == 1) continue;
    if (group.parts_went) {
      const double now = glm::length(force_of(all, g));
      group.strength = now > group.last_force ? group.last_force / now : 1;
      group.parts_went = false;
    } else {
      group.strength = std::min(1.0, group.strength + step_of(tick) / kFadeTime);
    }
  }
}

/// Layers whose force exceeds their break force begin to break.
void break_layers(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  for (BreakState& parts : all.breaking) parts.force = Vec3(0);
  for (const PlacedContact& c : all.contacts) {
    if (BreakState* const parts = breaking_of(tick, c))
      parts->force += c.loaded.force * c.loaded.contact.normal;
  }
  for (std::size_t i = 0; i < all.breaking.size(); ++i) {
    BreakState& parts = all.breaking[i];
    const double most = tick.scene.breaking()[i].force;
    if (glm::dot(parts.force, parts.force) > most * most) {
      parts.giving_way = true;
      all.exceptions = true;
    }
    if (!(parts.giving_way && parts.strength > 0)) continue;
    parts.strength = std::max(0.0, parts.strength - step_of(tick) / kFadeTime);
    if (parts.strength == 0) remove_parts(tick, static_cast<std::uint32_t>(i));
  }
}

}  // namespace

Vec3 tail_force(const Vec3& torque, double along, const Vec3& d) {
  const double length = glm::length(d);
  if (!(length > 0)) return Vec3(0);
  const Vec3 u = d / length;
  return (glm::cross(torque, u) + along * u) / length;
}

Rendering sum_unions(const UnionTick& tick, const LineProbe& probe) {
  const UnionMemory& all = tick.state.unions;
  const bool tool = tick.scene.tool() != nullptr;
  Rendering out;
  out.ideal = probe;
  if (tool) out.ideal_side = tick.tool.frame[0];
  const PlacedContact* deepest = nullptr;
  const double length = glm::length(tick.tool.d);
  double along = 0;  // N m, sum of each contact's lever times its force along the stylus
  for (const PlacedContact& c : all.contacts) {
    const Vec3 force =
        c.loaded.force * c.loaded.contact.normal + c.loaded.stiffness * c.loaded.tangential_offset;
    out.force += force;
    if (tick.sides) {
      const Vec3 lever = c.place + c.loaded.tangential_offset - probe.tip;
      out.torque += glm::cross(lever, force);
      if (tool && length > 0)
        along += glm::dot(lever, tick.tool.d) * glm::dot(force, tick.tool.d) / (length * length);
      if (!tool) out.device2 += c.loaded.probe_fraction * force;
    }
    if (deepest == nullptr || c.loaded.contact.depth > deepest->loaded.contact.depth) deepest = &c;
  }
  if (tool && tick.sides) out.device2 = tail_force(out.torque, along, tick.tool.d);
  out.device1 = out.force - out.device2;
  out.contacts = static_cast<int>(all.contacts.size());
  out.faults = tick.faults;
  if (deepest == nullptr) {
    show_behind(all, tool, probe.tip, out);
    return out;
  }
  const Vec3 shift = deepest->shift + deepest->loaded.tangential_offset;
  const GroupState& group = all.groups[deepest->group];
  out.deepest = deepest->loaded.contact;
  out.deepest.point = deepest->place + deepest->loaded.tangential_offset;
  out.object = deepest->loaded.object;
  out.ideal = {probe.tip + shift, probe.tail + shift};
  if (deepest->by_law) out.ideal.tail = out.ideal.tip + group.ideal.d;
  if (tool) {
    out.segment = deepest->segment;
    out.ideal_side = group.ideal.frame[0];
    out.deepest.along =
        length > 0 ? glm::dot(out.deepest.point - out.ideal.tip, group.ideal.d) / length : 0;
  } else if (tick.sides) {
    out.deepest.along = deepest->loaded.probe_fraction * length;
  }
  const Vec3 sum = out.force + out.torque + out.device2;
  if (std::isfinite(sum.x + sum.y + sum.z)) return out;
  Rendering none;
  none.ideal = probe;
  none.faults = tick.faults | render_fault::kNonFinite;
  return none;
}

void remember_ideal_tool(UnionTick& tick, std::uint32_t group, const ToolPose& pose,
                         const Vec3& shift, bool held, std::size_t first_contact) {
  UnionMemory& all = tick.state.unions;
  GroupState& memory = all.groups[group];
  const Tool* const carried = tick.sides ? tick.scene.tool() : nullptr;
  // Usually the ideal tool has taken the whole turn.
  const bool behind = pose.d != tick.tool.d || pose.frame != tick.tool.frame;
  const double angle = behind ? angle_between(carried, pose, tick.tool) : 0;
  memory.touching = held || angle > 0 || shift != Vec3(0);
  memory.ideal = pose;
  memory.ideal.tip = tick.tool.tip + shift;
  memory.lag = angle;
  if (angle > all.most_lag) {
    all.most_lag = angle;
    all.most_behind = group;
  }
  all.exceptions |= angle > kMostLag;
  const double size = carried != nullptr ? tick.scene.tool_reach() : glm::length(pose.d);
  all.reach = std::max(all.reach, glm::length(shift) + angle * size);
  Vec3 grasp(0);
  double weight = 0;
  for (std::size_t i = first_contact; i < all.contacts.size(); ++i) {
    const PlacedContact& c = all.contacts[i];
    const double share = c.loaded.normal_displacement;
    weight += share;
    grasp += share * (carried != nullptr
                          ? glm::transpose(pose.frame) * (c.place - c.shift - tick.tool.tip)
                          : Vec3(0, 0, c.loaded.probe_fraction));
  }
  if (weight > 0) memory.grasp = grasp / weight;
}

void follow_ideal_tool(UnionTick& tick, std::uint32_t group) { IdealTool(tick, group).follow(); }

bool inside_group(UnionTick& tick, std::uint32_t group) {
  return NearPairs(tick, tick.scene.groups()[group]).virtual_inside();
}

bool is_off(const UnionTick& tick, const PartGroup& group) {
  const ObjectState& object = tick.state.unions.objects[group.object_state];
  return !group.felt || object.off || object.just_left;
}

void update_objects(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  if (!all.exceptions && tick.state.has_last) return;
  all.exceptions = false;
  for (std::uint32_t i = 0; i < all.objects.size(); ++i) {
    ObjectState& object = all.objects[i];
    object.just_left = false;
    if (!tick.state.has_last && !left(tick, i)) {
      object.started_inside = true;
      switch_off(tick, i);
    } else if (object.off && left(tick, i)) {
      object = {};
      object.just_left = true;
      restore_layers(tick, i);
    }
    if (object.off)
      tick.faults |= object.started_inside ? render_fault::kStartedInside : render_fault::kReleased;
    all.exceptions |= object.off || object.just_left || object.releasing || object.lagging > 0;
  }
  for (std::size_t i = 0; i < all.breaking.size(); ++i) {
    const std::uint32_t object = tick.scene.breaking()[i].object_state;
    if (!all.breaking[i].giving_way) continue;
    // Restore the parts one tick later, so that the ideal tool comes from outside. It may be inside
    // them if the virtual tool has passed through the object.
    if (all.breaking[i].was_left) {
      restore(tick, i);
    } else {
      const bool held = all.groups[tick.scene.breaking()[i].group].touching;
      all.breaking[i].was_left = !all.objects[object].off && !held && left(tick, object);
    }
    all.exceptions |= all.breaking[i].giving_way;
  }
}

void fade_forces(UnionTick& tick) {
  UnionMemory& all = tick.state.unions;
  if (!all.breaking.empty()) {
    raise_forces(tick);
    break_layers(tick);
  }
  if (!all.exceptions) return;
  release_hooked(tick);
  for (PlacedContact& c : all.contacts) {
    const std::uint32_t object = tick.scene.groups()[c.group].object_state;
    const BreakState* const parts = breaking_of(tick, c);
    const double strength = all.objects[object].strength * all.groups[c.group].strength *
                            (parts != nullptr ? parts->strength : 1);
    c.loaded.force *= strength;
    c.loaded.stiffness *= strength;  // of friction
  }
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    if (all.groups[g].parts_went) all.groups[g].last_force = glm::length(force_of(all, g));
  }
  for (std::uint32_t i = 0; i < all.objects.size(); ++i) {
    ObjectState& object = all.objects[i];
    if (object.releasing && object.strength == 0 && !object.off) switch_off(tick, i);
  }
}

}  // namespace palpate::rendering
