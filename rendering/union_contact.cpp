#include "rendering/union_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "rendering/active_planes.h"
#include "rendering/approach.h"
#include "rendering/equivalent_point.h"
#include "rendering/pair_cast.h"
#include "rendering/render_fault.h"
#include "rendering/segment_probe.h"

namespace palpate::rendering {
namespace {

using Kind = ContactFeature::Kind;

constexpr int kRounds = 96;         // of casts in one tick; then the ideal tool stays where it is
constexpr int kPushRounds = 12;     // to get out of what a turn brought the tool into
constexpr int kHalvings = 4;        // of a turn that fails; then it waits for the next tick
constexpr double kFarPush = 8;      // times the turn's own motion; farther is no way out
constexpr double kSlidOff = 4;      // skins; a contact farther off its facet has left it
constexpr double kOnFacet = 1e-11;  // of the size, the same where the skin is thin
constexpr double kSamePlace = 8;    // skins; within it a contact that comes back never left
constexpr double kExact = 1e-5;     // of the skin; what is nearer than this is rounding

/// A plane that holds the ideal tool. Translations are relative to the virtual tool's tip.
struct Plane {
  std::uint32_t near = 0;  ///< index of the pair in UnionMemory::near
  ContactFeature feature;
  Vec3 normal;            ///< world, out of the part
  double depth = 0;       ///< m, of the virtual tool below it: dot(normal, y) >= depth outside
  double multiplier = 0;  ///< m, of the normal in the way from the virtual to the ideal tool
  bool stays = false;     ///< came back where it had let go: rounding, it is not let go there again
};

class Planes {
 public:
  std::span<Plane> all() { return {planes_.data(), count_}; }
  std::span<const Plane> all() const { return {planes_.data(), count_}; }
  bool full() const { return count_ == planes_.size(); }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = 0; }
  void add(const Plane& plane) { planes_[count_++] = plane; }
  template <class Drop>
  void remove_if(const Drop& drop) {
    count_ = static_cast<std::size_t>(
        std::remove_if(planes_.begin(), planes_.begin() + static_cast<std::ptrdiff_t>(count_),
                       drop) -
        planes_.begin());
  }

  /// The point nearest to `origin` at least `skin` above all planes; sets the multipliers.
  bool nearest(const Vec3& origin, double skin, double tolerance, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i)
      spaces[i] = {planes_[i].normal,
                   planes_[i].depth + skin - glm::dot(planes_[i].normal, origin)};
    return solve(spaces, tolerance, origin, point);
  }

  /// The same to the virtual tool, from `at`, which is allowed: no plane asks for more than is
  /// there.
  bool nearest_from(const Vec3& at, double skin, double tolerance, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i)
      spaces[i] = {planes_[i].normal,
                   std::min(planes_[i].depth + skin, glm::dot(planes_[i].normal, at))};
    return solve(spaces, tolerance, Vec3(0), point);
  }

 private:
  bool solve(const std::array<PlaneBound, kMostPlanes>& spaces, double tolerance,
             const Vec3& origin, Vec3& point) {
    const ConstrainedPoint nearest =
        constrained_point(std::span<const PlaneBound>(spaces.data(), count_), tolerance);
    if (!nearest.found) return false;
    for (std::size_t i = 0; i < count_; ++i) planes_[i].multiplier = nearest.multipliers[i];
    point = origin + nearest.point;
    return true;
  }

  std::array<Plane, kMostPlanes> planes_;
  std::size_t count_ = 0;
};

/// Where a motion of the tool first enters a pair.
struct Entry {
  bool entered = false;
  double time = 2;  ///< of the motion
  ContactFeature feature;
};

/// m; how far any point of the tool is from one pose to another at most.
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

/// The ideal tool of one group, in one tick.
class IdealTool {
 public:
  IdealTool(UnionTick& tick, std::uint32_t group_index)
      : tick_(tick),
        all_(tick.state.unions),
        index_(group_index),
        group_(tick.scene.groups()[group_index]),
        memory_(all_.groups[group_index]),
        carried_(tick.sides ? tick.scene.tool() : nullptr) {}

  void follow();
  bool virtual_inside();

 private:
  const ScenePart& part_of(const NearPair& near) const { return tick_.scene.parts()[near.part]; }
  PairState& state_of(const NearPair& near) { return all_.pairs[near.pair]; }
  CastMesh mesh_of(const NearPair& near) {
    const ScenePart& part = part_of(near);
    return {*part.mesh, *part.trees, part.inside, all_.full_scans};
  }
  PlacedTool placed(const ToolPose& pose) const { return place(carried_, tick_.sides, pose); }
  Vec3 turned(const Vec3& grasp, const ToolPose& pose) const {
    return carried_ != nullptr ? pose.frame * grasp : grasp.z * pose.d;
  }

  template <class Visit>
  void visit_near_parts(const Visit& visit) const;
  void take_up_plane(NearPair& near);
  void collect(const ToolPose& from, const PlacedTool& placed_from, double motion, double reach);
  void orient(const PlacedTool& oriented);
  Vec3 local(const NearPair& near, const Vec3& y) const {
    return near.tip + part_of(near).shrink * part_of(near).local_vector(y);
  }
  LineProbe shrunk(const NearPair& near, const Vec3& tip, const PlacedSegment& segment) const;

  Entry sweep(NearPair& near, const LineProbe& before, const LineProbe& after);
  ToolPose first_contact(const ToolPose& from, bool& entered);
  void turn(const ToolPose& from);
  bool settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
              double most_push);
  bool push_out(const Vec3& from, double most_push);
  bool violated(NearPair& near, const Vec3& y, bool cast_too, const Vec3& from);
  Plane plane_of(std::uint32_t near, ContactFeature feature) const;
  bool put_plane(std::uint32_t near, ContactFeature feature);
  void resume_planes();
  void translate();
  bool next_hit(const Vec3& goal, std::uint32_t& near, PairCast& first);
  void move_to_hit(const Vec3& goal, std::uint32_t near, const PairCast& hit);
  bool let_go_of_planes();
  bool slid_off(const Plane& plane) const;
  bool parted_here(const NearPair& near) const;
  void add_contacts();
  void add_contact(const Plane& plane, const Vec3& shift);
  void spread_over_parts(const NearPair& carrying, const WalkResult& hit, const Vec3& tip,
                         LoadedContact& c);
  void remember(std::size_t first_contact);

  UnionTick& tick_;
  UnionMemory& all_;
  std::uint32_t index_;
  const PartGroup& group_;
  GroupState& memory_;
  const Tool* carried_;
  ToolPose pose_;      ///< of the ideal tool: its orientation; the tip is the virtual one plus at_
  PlacedTool placed_;  ///< the same
  Vec3 at_;            ///< m, from the virtual tip to the ideal one
  Planes planes_;
  bool stuck_ = false;
};

template <class Visit>
void IdealTool::visit_near_parts(const Visit& visit) const {
  const auto& near = tick_.state.near_parts;
  const std::uint32_t end = group_.first_part + group_.part_count;
  for (auto i = std::lower_bound(near.begin(), near.end(), group_.first_part);
       i != near.end() && *i < end; ++i) {
    visit(*i);
  }
}

/// The segment in the part's frame, seen smaller by the part's margin.
LineProbe IdealTool::shrunk(const NearPair& near, const Vec3& tip,
                            const PlacedSegment& segment) const {
  const ScenePart& part = part_of(near);
  const Vec3 from = part.local_point(tip + segment.from);
  const Vec3 start = part.inside + part.shrink * (from - part.inside);
  return {start, start + part.shrink * part.local_vector(segment.along)};
}

/// Takes up the plane of an earlier tick.
void IdealTool::take_up_plane(NearPair& near) {
  const SeparatingPlane& plane = state_of(near).plane;
  near.has_plane = plane.valid;
  if (!plane.valid) return;
  const ScenePart& part = part_of(near);
  near.normal = part.world_vector(plane.normal);
  near.offset =
      plane.offset + glm::dot(near.normal, part.position) + 2 * (part.margin + part.tolerance);
}

/// m, of a segment above the plane of a pair.
double height_above(const NearPair& near, const Vec3& tip, const PlacedSegment& segment) {
  return glm::dot(near.normal, tip + segment.from) - near.offset +
         std::min(0.0, glm::dot(near.normal, segment.along));
}

/// Whether the pair's plane keeps the segment from the part all the way between two translations.
bool apart(const NearPair& near, const Vec3& from, const Vec3& to) {
  return near.has_plane && glm::dot(near.normal, from) + near.height > 0 &&
         glm::dot(near.normal, to) + near.height > 0;
}

/// Sets the pairs that the tool can touch while it comes from `from` and then stays within `reach`
/// of the virtual tool.
/// \param motion  m, of any point of the tool from there to the virtual tool
void IdealTool::collect(const ToolPose& from, const PlacedTool& placed_from, double motion,
                        double reach) {
  all_.near.clear();
  const PlacedTool now = placed(tick_.tool);
  visit_near_parts([&](std::uint32_t index) {
    const ScenePart& part = tick_.scene.parts()[index];
    for (std::uint32_t j = 0; j < now.count; ++j) {
      NearPair near;
      near.part = index;
      near.segment = j;
      near.pair = group_.first_pair +
                  (index - group_.first_part) * static_cast<std::uint32_t>(tick_.scene.segments()) +
                  j;
      PairState& state = state_of(near);
      if (!state.carries) {
        const Vec3 to_start = part.sphere_centre - (tick_.tool.tip + now.segments[j].from);
        const Vec3& along = now.segments[j].along;
        const double length2 = glm::dot(along, along);
        const double fraction =
            length2 > 0 ? std::clamp(glm::dot(to_start, along) / length2, 0.0, 1.0) : 0;
        const Vec3 apart = to_start - fraction * along;
        const double far =
            part.sphere_radius + std::max(motion, reach) + 2 * part.margin + part.tolerance;
        if (glm::dot(apart, apart) > far * far) continue;
        take_up_plane(near);
        near.was_apart =
            near.has_plane && height_above(near, from.tip, placed_from.segments[j]) > 0;
        if (near.was_apart && height_above(near, tick_.tool.tip, now.segments[j]) > reach) continue;
      }
      all_.near.push_back(near);
    }
  });
}

/// Puts the near pairs' segments where the tool of this orientation has them.
void IdealTool::orient(const PlacedTool& oriented) {
  placed_ = oriented;
  for (NearPair& near : all_.near) {
    const ScenePart& part = part_of(near);
    const PlacedSegment& segment = oriented.segments[near.segment];
    near.true_tip = part.local_point(tick_.tool.tip + segment.from);
    near.true_d = part.local_vector(segment.along);
    near.tip = part.inside + part.shrink * (near.true_tip - part.inside);
    near.d = part.shrink * near.true_d;
    if (near.has_plane) near.height = height_above(near, tick_.tool.tip, segment);
  }
}

/// A segment whose ends move linearly: where it first enters the part. Remembers what separates
/// them where it does not.
Entry IdealTool::sweep(NearPair& near, const LineProbe& before, const LineProbe& after) {
  PairState& state = state_of(near);
  const CastMesh mesh = mesh_of(near);
  const Vec3 d = before.tail - before.tip;
  const WalkResult start = locate(mesh, state.feature, before.tip, d);
  if (start.feature.kind != Kind::none) return {true, 0, start.feature};
  const bool point = glm::dot(d, d) == 0 && before.tail - before.tip == after.tail - after.tip;
  Approach approach;
  if (start.separating_feature.kind != Kind::none)
    approach = point ? approach_point(mesh.mesh, start.separating_feature, before, after)
                     : approach_segment(mesh.mesh, start.separating_feature, before, after);
  if (approach.end == Approach::End::separated) {
    state.feature = approach.feature;
    state.plane = approach.plane;
    return {};
  }
  if (approach.end == Approach::End::entered) return {true, approach.time, approach.feature};
  const double tolerance = part_of(near).tolerance;
  const FirstContact first =
      point ? first_contact_point(mesh.mesh, mesh.trees, before.tip, after.tip, tolerance)
            : first_contact_segment(mesh.mesh, mesh.trees, before, after, tolerance);
  if (first.feature.kind != Kind::none) return {true, first.time, first.feature};
  const WalkResult end = locate(mesh, start.separating_feature, after.tip, after.tail - after.tip);
  if (end.feature.kind != Kind::none) return {true, 1, end.feature};
  state.feature = end.separating_feature;
  return {};
}

/// The pose at which a tool that comes from free space meets the first part; the virtual one where
/// it meets none.
ToolPose IdealTool::first_contact(const ToolPose& from, bool& entered) {
  const PlacedTool before = placed(from), after = placed(tick_.tool);
  collect(from, before, motion_of(from, before, tick_.tool, after), 0);
  Entry first;
  const NearPair* at = nullptr;
  for (NearPair& near : all_.near) {
    const Entry entry = sweep(near, shrunk(near, from.tip, before.segments[near.segment]),
                              shrunk(near, tick_.tool.tip, after.segments[near.segment]));
    if (!entry.entered) continue;
    state_of(near).feature = entry.feature;
    if (entry.time >= first.time) continue;
    first = entry;
    at = &near;
  }
  entered = at != nullptr;
  if (!entered) return tick_.tool;
  ToolPose pose = between(from, tick_.tool, first.time);
  // It turns on about where it touches.
  const PlacedSegment segment = placed(pose).segments[at->segment];
  const LineProbe local = shrunk(*at, pose.tip, segment);
  const WalkResult contact =
      measure(*part_of(*at).mesh, first.feature, local.tip, local.tail - local.tip);
  const Vec3 grasp = segment.from + contact.probe_fraction * segment.along;
  memory_.grasp =
      carried_ != nullptr ? glm::transpose(pose.frame) * grasp : Vec3(0, 0, contact.probe_fraction);
  return pose;
}

Plane IdealTool::plane_of(std::uint32_t index, ContactFeature feature) const {
  const NearPair& near = all_.near[index];
  const ScenePart& part = part_of(near);
  const WalkResult at = measure(*part.mesh, feature, near.true_tip, near.true_d);
  Plane plane;
  plane.near = index;
  plane.feature = at.feature.kind != Kind::none ? at.feature : at.separating_feature;
  plane.normal = part.world_vector(at.normal);
  plane.depth = at.depth;
  return plane;
}

/// Puts the plane of a pair in use, in place of the one it had. False where there is no room.
bool IdealTool::put_plane(std::uint32_t index, ContactFeature feature) {
  const Plane plane = plane_of(index, feature);
  state_of(all_.near[index]).feature = plane.feature;
  for (Plane& old : planes_.all()) {
    if (old.near != index) continue;
    old = plane;
    return true;
  }
  if (planes_.full()) return false;
  all_.near[index].carries = true;
  planes_.add(plane);
  return true;
}

/// Turns the ideal tool as the virtual one has turned, about where it touches, as far as the parts
/// let it.
void IdealTool::turn(const ToolPose& from) {
  const PlacedTool before = placed(from), after = placed(tick_.tool);
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
  collect(from, before, reach, reach);
  if (motion == 0) {
    pose_ = tick_.tool;
    at_ = from.tip - tick_.tool.tip;
    orient(before);
    return;
  }
  double fraction = 1;
  for (int i = 0; i <= kHalvings; ++i, fraction *= 0.5) {
    ToolPose to = i == 0 ? tick_.tool : between(from, tick_.tool, fraction);
    to.tip = from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to);
    if (settle(from, before, to, far)) {
      pose_ = to;
      return;
    }
  }
  pose_ = from;
  at_ = from.tip - tick_.tool.tip;
  planes_.clear();
  orient(before);
}

/// Whether a turned tool gets out of all parts near where it is; then it is there.
bool IdealTool::settle(const ToolPose& from, const PlacedTool& placed_from, const ToolPose& to,
                       double most_push) {
  orient(placed(to));
  planes_.clear();
  for (NearPair& near : all_.near) near.carries = false;
  at_ = to.tip - tick_.tool.tip;
  for (std::uint32_t i = 0; i < all_.near.size(); ++i) {
    NearPair& near = all_.near[i];
    PairState& state = state_of(near);
    ContactFeature start = state.feature;
    const Vec3 tip = local(near, at_);
    if (!state.carries) {
      if (near.was_apart && apart(near, at_, at_)) continue;
      near.was_cast = true;
      const Entry entry = sweep(near, shrunk(near, from.tip, placed_from.segments[near.segment]),
                                {tip, tip + near.d});
      if (!entry.entered) continue;
      start = entry.feature;
    }
    const WalkResult at = locate(mesh_of(near), start, tip, near.d);
    if (at.feature.kind != Kind::none && !put_plane(i, at.feature)) return false;
  }
  return planes_.empty() || push_out(at_, most_push);
}

/// Moves the tool out of the parts whose planes are in use, and of those that it comes into then.
bool IdealTool::push_out(const Vec3& from, double most_push) {
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.nearest(from, group_.skin, group_.skin / 8, at_)) return false;
    const Vec3 moved = at_ - from;
    if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    bool out = true;
    for (std::uint32_t i = 0; i < all_.near.size(); ++i) {
      NearPair& near = all_.near[i];
      ContactFeature inside;
      if (near.carries) {
        inside = locate(mesh_of(near), state_of(near).feature, local(near, at_), near.d).feature;
      } else {
        if (apart(near, from, at_)) continue;
        near.was_cast = true;
        const PairCast hit = cast(mesh_of(near), state_of(near).feature, local(near, from), near.d,
                                  part_of(near).shrink * part_of(near).local_vector(moved));
        state_of(near).feature = hit.feature;
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

/// Takes up the planes that held the tool at the last tick, where it is still beyond them.
void IdealTool::resume_planes() {
  planes_.remove_if([](const Plane& plane) { return plane.multiplier <= 0; });
  for (NearPair& near : all_.near) near.carries = false;
  for (const Plane& plane : planes_.all()) all_.near[plane.near].carries = true;
  for (std::uint32_t i = 0; i < all_.near.size() && !planes_.full(); ++i) {
    NearPair& near = all_.near[i];
    if (!state_of(near).carries || near.carries) continue;
    const Plane plane = plane_of(i, state_of(near).feature);
    if (!(glm::dot(plane.normal, at_) - plane.depth > 0)) continue;
    near.carries = true;
    planes_.add(plane);
  }
}

/// The first part on the straight way to `goal`.
bool IdealTool::next_hit(const Vec3& goal, std::uint32_t& hit, PairCast& first) {
  first.time = 2;
  const Vec3 way = goal - at_;
  for (std::uint32_t i = 0; i < all_.near.size(); ++i) {
    NearPair& near = all_.near[i];
    if (near.carries) continue;  // convex, and behind a plane that the way stays beyond
    if (apart(near, at_, goal)) continue;
    near.was_cast = true;
    const PairCast found = cast(mesh_of(near), state_of(near).feature, local(near, at_), near.d,
                                part_of(near).shrink * part_of(near).local_vector(way));
    state_of(near).feature = found.feature;
    if (!found.hit || !(found.time < first.time)) continue;
    first = found;
    hit = i;
  }
  return first.time <= 1;
}

bool IdealTool::slid_off(const Plane& plane) const {
  const NearPair& near = all_.near[plane.near];
  const stimuli::ConvexMesh& mesh = *part_of(near).mesh;
  const double slack = kSlidOff * group_.skin + kOnFacet * (mesh.size() + glm::length(near.d));
  return distance_off(mesh, plane.feature, local(near, at_), near.d) > slack;
}

/// Whether the pair let go of the ideal tool where that is now, within rounding.
bool IdealTool::parted_here(const NearPair& near) const {
  const double same = kSamePlace * group_.skin;
  const Vec3 apart = at_ - near.parted_at;
  return near.parted && glm::dot(apart, apart) <= same * same;
}

/// Lets go of planes that hold nothing, and of those whose facet the tool has slid off. True when
/// there is one of the latter.
bool IdealTool::let_go_of_planes() {
  bool slid = false;
  planes_.remove_if([&](const Plane& plane) {
    NearPair& near = all_.near[plane.near];
    const bool off = plane.multiplier > 0 && !(plane.stays && parted_here(near)) && slid_off(plane);
    if (plane.multiplier > 0 && !off) return false;
    near.carries = false;
    if (off) {
      near.parted = true;
      near.parted_at = at_;
      slid = true;
    }
    return true;
  });
  return slid;
}

void IdealTool::move_to_hit(const Vec3& goal, std::uint32_t index, const PairCast& hit) {
  Plane plane = plane_of(index, hit.feature);
  // It stops a skin before the plane.
  const Vec3 way = goal - at_;
  const double rate = glm::dot(plane.normal, way);
  const double height = glm::dot(plane.normal, at_) - plane.depth;
  const double time = rate < 0 ? std::clamp((height - group_.skin) / -rate, 0.0, hit.time) : 0.0;
  at_ += time * way;
  if (time * glm::length(way) > kSamePlace * group_.skin) let_go_of_planes();
  NearPair& near = all_.near[index];
  plane.stays = parted_here(near);
  near.carries = true;
  state_of(near).feature = plane.feature;
  if (planes_.full())
    planes_.remove_if([&](const Plane& old) {
      if (old.multiplier > 0) return false;
      all_.near[old.near].carries = false;
      return true;
    });
  if (planes_.full()) {
    near.carries = false;
    stuck_ = true;
    return;
  }
  planes_.add(plane);
}

/// Moves the ideal tool as near to the virtual one as the parts let it.
void IdealTool::translate() {
  const double tolerance = group_.skin / 8;
  for (int round = 0; round < kRounds && !stuck_; ++round) {
    Vec3 goal;
    if (!planes_.nearest(Vec3(0), group_.skin, tolerance, goal) &&
        !planes_.nearest_from(at_, group_.skin, tolerance, goal)) {
      break;
    }
    std::uint32_t near = 0;
    PairCast hit;
    if (next_hit(goal, near, hit)) {
      move_to_hit(goal, near, hit);
      continue;
    }
    at_ = goal;
    if (!let_go_of_planes()) return;
  }
  stuck_ = true;
}

/// Equation (2) over all faces that the segment lies along, of the part that carries it and of
/// those that abut.
/// \param tip  of the ideal segment, frame of the part that carries it
void IdealTool::spread_over_parts(const NearPair& carrying, const WalkResult& hit, const Vec3& tip,
                                  LoadedContact& c) {
  const ScenePart& part = part_of(carrying);
  const Vec3 world_tip = part.world_vector(tip) + part.position;
  std::array<FacedPart, kMostFacedParts> faced;
  std::size_t count = 0;
  faced[count++] = {&part, hit.feature, tip, carrying.true_d};
  for (const NearPair& other : all_.near) {
    if (other.segment != carrying.segment || other.part == carrying.part) continue;
    if (count == faced.size()) break;
    const ScenePart& beside = part_of(other);
    faced[count++] = {&beside, state_of(other).feature, beside.local_point(world_tip),
                      other.true_d};
  }
  spread_over_faces(std::span<const FacedPart>(faced.data(), count), hit, kSlidOff * group_.skin,
                    c);
}

void IdealTool::add_contact(const Plane& plane, const Vec3& shift) {
  const NearPair& near = all_.near[plane.near];
  const ScenePart& part = part_of(near);
  const PlacedSegment& segment = placed_.segments[near.segment];
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
    tick::SegmentProbe::classify(*part.mesh, at, tip, near.true_d, glm::length(near.true_d), c);
    if (part.shallow_ridges || c.contact.type == ContactType::segment_face)
      spread_over_parts(near, at, tip, c);
  } else {
    c.contact.type = ContactType::point_polygon;
  }
  out.shift = shift;
  const Vec3 on_tool = segment.from + c.probe_fraction * segment.along;
  out.place = tick_.tool.tip + shift + on_tool;
  const PlacedTool now = placed(tick_.tool);
  const PlacedTool before = tick_.state.has_last ? placed(all_.last) : now;
  const auto point_of = [&](const PlacedTool& tool) {
    return tool.segments[near.segment].from + c.probe_fraction * tool.segments[near.segment].along;
  };
  out.motion = tick_.state.has_last
                   ? tick_.tool.tip - all_.last.tip + point_of(now) - point_of(before)
                   : Vec3(0);
  out.group = index_;
  out.pair = near.pair;
  out.segment = static_cast<int>(near.segment);
  out.by_law = true;
  all_.contacts.push_back(out);
}

/// Contacts from the planes that hold the tool, without the skin.
void IdealTool::add_contacts() {
  Vec3& shift = memory_.shift;
  shift = at_;
  stuck_ = stuck_ || (!planes_.nearest(Vec3(0), 0, kExact * group_.skin, shift) &&
                      !planes_.nearest(Vec3(0), 0, group_.skin / 8, shift));
  if (stuck_) {
    // It stays where it is, and all of the force is that of the plane that holds most of it.
    tick_.faults |= render_fault::kContactCapped;
    const Plane* most = nullptr;
    for (const Plane& plane : planes_.all()) {
      if (most == nullptr || plane.multiplier > most->multiplier) most = &plane;
    }
    const double length = glm::length(at_);
    if (most == nullptr || !(length > 0)) return;
    Plane held = *most;
    held.normal = at_ / length;
    held.multiplier = length;
    add_contact(held, at_);
    return;
  }
  for (const Plane& plane : planes_.all()) {
    if (plane.multiplier > 0) add_contact(plane, shift);
  }
}

/// What the next tick needs.
void IdealTool::remember(std::size_t first_contact) {
  for (const NearPair& near : all_.near) {
    PairState& state = state_of(near);
    state.carries = near.carries;
    if (near.carries) state.plane.valid = false;
    if (near.carries || state.feature.kind == Kind::none) continue;
    if (near.has_plane && !near.was_cast) continue;
    const ScenePart& part = part_of(near);
    const Vec3 tip = near.true_tip + part.local_vector(at_);
    const WalkResult at = measure(*part.mesh, state.feature, tip, near.true_d);
    const double lower = std::min(glm::dot(at.normal, tip), glm::dot(at.normal, tip + near.true_d));
    state.plane = {at.normal, lower + at.depth, at.depth < 0};
  }
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

void IdealTool::follow() {
  ToolPose from = memory_.ideal;
  if (!memory_.touching) {
    bool entered = false;
    from = first_contact(tick_.state.has_last ? all_.last : tick_.tool, entered);
    if (!entered) return;
  }
  turn(from);
  resume_planes();
  translate();
  const std::size_t first_contact = all_.contacts.size();
  add_contacts();
  remember(first_contact);
}

/// Whether the virtual tool is inside of a part.
bool IdealTool::virtual_inside() {
  const PlacedTool now = placed(tick_.tool);
  collect(tick_.tool, now, 0, 0);
  orient(now);
  for (NearPair& near : all_.near) {
    const WalkResult at = locate(mesh_of(near), state_of(near).feature, near.true_tip, near.true_d);
    state_of(near).feature = at.feature.kind != Kind::none ? at.feature : at.separating_feature;
    if (at.feature.kind != Kind::none && at.depth > part_of(near).tolerance) return true;
  }
  return false;
}

}  // namespace

void follow_ideal_tool(UnionTick& tick, std::uint32_t group) { IdealTool(tick, group).follow(); }

bool inside_group(UnionTick& tick, std::uint32_t group) {
  return IdealTool(tick, group).virtual_inside();
}

}  // namespace palpate::rendering
