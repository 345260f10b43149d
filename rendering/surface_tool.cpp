#include "rendering/surface_tool.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/surface_patch.h"

namespace palpate::rendering {
namespace {

constexpr int kRounds = 96;          // casts a tick at most; then the ideal tool keeps its place
constexpr double kSlidOff = 4;       // skins; farther off its patch, a contact has ended
constexpr double kAtRest = 2e-12;    // of the size; the same without the skin
constexpr double kOnPatch = 1e-11;   // of the size
constexpr double kExact = 1e-5;      // of the skin; shorter distances are rounding
constexpr double kRounding = 0.125;  // of the skin; tolerance of its width
constexpr double kLessSkin = 0.25;   // of the skin, repeatedly, in a gap narrower than two
constexpr double kInTheWay = 0.25;   // of the tolerance; a patch that is deeper holds the tool
constexpr double kSamePlace = 8;     // skins; within them a returning contact never left
// The skin hides the bottom of a flat valley: its sides would alternate endlessly. A tool that is
// held `depth` off its goal goes from the nearest place of one side to that of the other, depth
// times the angle between them, and does not meet the side that it leaves where that way times the
// angle is less than the skin: on ways of up to the root of skin times depth.
constexpr int kTimes = 2;             // releases by one patch in a tick
constexpr double kSameValley = 1e-6;  // of the size
constexpr double kHiddenWay = 4;      // of that root
constexpr int kMostInTheWay = 4;
constexpr int kPieces = 64;  // of a long cast, examined one by one

/// m, between places of rest on the two sides of a flat valley. \param depth  of the tool
double hidden_way(double size, double skin, double depth) {
  return std::max(kSameValley * size, kHiddenWay * std::sqrt(skin * depth));
}

}  // namespace

/// Collects the listed patches for the turned tool.
void SurfaceTool::collect_patches() {
  own_.patches.clear();
  if (!own_.has_list) return;
  for (const NearTriangle& near : own_.near) {
    for_each_patch(surface_, near.triangle, near.segment, near.what,
                   turned_.segments[near.segment].along, [&](const SurfacePatch& patch) {
                     if (own_.patches.size() < own_.patches.capacity())
                       own_.patches.push_back({plane_of(surface_, patch, turned_), patch});
                   });
  }
}

/// Finds the first patch on a straight line.
PatchHit SurfaceTool::cast(const Vec3& from, const Vec3& to) const {
  PatchHit first;
  const Vec3 way = to - from;
  const double length = glm::length(way);
  if (!(length > 0)) return first;
  double done = 0;
  const double room = room_left(turned_, from);
  if (room > 0) {
    for (const NearPatch& near : own_.patches)
      cast_on_patch(surface_, near.patch, near.plane, turned_, from, to, tolerance_, first);
    done = std::min(1.0, room / length);
    if (first.time <= done || done == 1) return first;
    first = {};
  }
  const double piece = std::max({own_.wanted_room, skin_, length / kPieces}) / length;
  while (done < 1) {
    const double end = std::min(1.0, done + 2 * piece);
    const Vec3 middle = from + 0.5 * (done + end) * way;
    const double reach = 0.5 * (end - done) * length + 2 * skin_;
    for (std::size_t j = 0; j < turned_.count; ++j) {
      const PosedTool::Segment& segment = turned_.segments[j];
      surface_.touchable(
          segment.start + middle, segment.along, {reach, reach}, [&](std::uint32_t triangle) {
            for_each_patch(surface_, triangle, static_cast<std::uint8_t>(j), surface_pair::kAll,
                           segment.along, [&](const SurfacePatch& patch) {
                             cast_on_patch(surface_, patch,
                                           rendering::plane_of(surface_, patch, turned_), turned_,
                                           from, to, tolerance_, first);
                           });
            return true;
          });
    }
    if (first.time <= end) return first;
    first = {};
    done = end;
  }
  return first;
}

bool SurfaceTool::holds(const SurfacePatch& patch) const {
  const auto all = planes_.all();
  return std::any_of(all.begin(), all.end(),
                     [&](const SurfacePlane& plane) { return plane.patch == patch; });
}

/// Adds the planes that held the tool at the last tick, if it is still outside of them.
void SurfaceTool::resume_planes() {
  // Drop planes of the turn that the tool does not rest on.
  planes_.remove_if([&](const SurfacePlane& plane) {
    return plane.multiplier <= 0 || !(glm::dot(plane.normal, at_) - plane.depth > 0);
  });
  for (std::size_t i = 0; i < own_.carrying_count && !planes_.full(); ++i) {
    const SurfacePlane plane = plane_at(own_.carrying[i]);
    if (holds(plane.patch) || !(glm::dot(plane.normal, at_) - plane.depth > 0)) continue;
    planes_.add(plane);
  }
}

/// m, distance of the tool from the patch of a plane, along the plane.
double SurfaceTool::off_patch(const SurfacePlane& plane, const Vec3& at) const {
  return distance_off(polygon_of(surface_, plane.patch, turned_), plane.normal, at);
}

bool SurfaceTool::parted_here(const SurfacePatch& patch) const {
  const double same = kSamePlace * skin_;
  for (std::size_t i = 0; i < parted_count_; ++i) {
    const Parted& parted = parted_[i];
    if (!(parted.patch == patch)) continue;
    const double far =
        parted.times < kTimes ? same : hidden_way(surface_.size(), skin_, glm::length(at_));
    const Vec3 apart = at_ - parted.at;
    return glm::dot(apart, apart) <= far * far;
  }
  return false;
}

/// Drops planes that hold nothing.
void SurfaceTool::let_go_of_idle_planes() {
  planes_.remove_if([](const SurfacePlane& plane) { return !(plane.multiplier > 0); });
}

/// Drops planes whose patch the tool has slid off; returns whether there were any.
bool SurfaceTool::let_go_of_slid_planes(const Vec3& at, double slack) {
  bool slid = false;
  planes_.remove_if([&](SurfacePlane& plane) {
    if (plane.stays && parted_here(plane.patch)) return false;
    if (!(off_patch(plane, at) > slack)) return false;
    std::size_t known = 0;
    while (known < parted_count_ && !(parted_[known].patch == plane.patch)) ++known;
    if (known == parted_.size()) {  // forget the oldest
      std::move(parted_.begin() + 1, parted_.end(), parted_.begin());
      parted_[--known].times = 0;
    }
    if (known == parted_count_) parted_[parted_count_++].times = 0;
    parted_[known] = {plane.patch, at_, parted_[known].times + 1};
    slid = true;
    return true;
  });
  return slid;
}

/// Finds the place of rest without the skin, and the multipliers. False if rounding hides it.
bool SurfaceTool::find_exact_place() {
  return planes_.nearest(Vec3(0), 0, kExact * skin_, exact_) ||
         planes_.nearest(Vec3(0), 0, kRounding * skin_, exact_);
}

/// Whether the tool rests on a patch with the skin but beyond its border without it: a groove's
/// patches may end in between and leave a gap that is narrower than the skin.
bool SurfaceTool::past_a_patch_at_rest() const {
  const double size = surface_.size(), slack = kSlidOff * skin_ + kOnPatch * size;
  bool past = false, off = false;
  for (const SurfacePlane& plane : planes_.all()) {
    if (!(plane.multiplier > 0)) continue;
    past = past || (plane.stays && off_patch(plane, exact_) > kOnPatch * size);
    off = off || off_patch(plane, at_) > slack;
  }
  return past && !off;
}

/// Looks for a patch that the tool enters when the skin is removed; sets its plane.
bool SurfaceTool::in_the_way_at_rest(SurfacePlane& out) const {
  double deepest = kInTheWay * tolerance_;
  bool found = false;
  const auto look = [&](const SurfacePatch& patch, const PatchPlane& plane) {
    const double under = plane.depth - glm::dot(plane.normal, exact_);
    if (!(under > deepest) || plane.depth - glm::dot(plane.normal, at_) > tolerance_) return;
    if (holds(patch)) return;
    PatchHit hit;
    cast_on_patch(surface_, patch, plane, turned_, at_, exact_, tolerance_, hit);
    if (!hit.hit()) return;
    deepest = under;
    found = true;
    out = {patch, plane.normal, plane.depth};
  };
  if (room_left(turned_, exact_) > 0) {
    for (const NearPatch& near : own_.patches) look(near.patch, near.plane);
    return found;
  }
  for (std::size_t j = 0; j < turned_.count; ++j) {
    const PosedTool::Segment& segment = turned_.segments[j];
    surface_.touchable(
        segment.start + exact_, segment.along, {4 * skin_, 4 * skin_}, [&](std::uint32_t triangle) {
          for_each_patch(
              surface_, triangle, static_cast<std::uint8_t>(j), surface_pair::kAll, segment.along,
              [&](const SurfacePatch& patch) { look(patch, plane_of(surface_, patch, turned_)); });
          return true;
        });
  }
  return found;
}

/// Adds a plane to those that hold the tool.
void SurfaceTool::take_plane(const SurfacePlane& plane) {
  if (planes_.full()) let_go_of_idle_planes();
  stuck_ = planes_.full();
  if (!stuck_) planes_.add(plane);
}

void SurfaceTool::move_to_hit(const Vec3& goal, const PatchHit& hit) {
  SurfacePlane plane = plane_at(hit.patch);
  // Stop one skin before the plane.
  const Vec3 way = goal - at_;
  const double rate = glm::dot(plane.normal, way);
  const double height = glm::dot(plane.normal, at_) - plane.depth;
  const double time = rate < 0 ? std::clamp((height - skin_) / -rate, 0.0, hit.time) : 0.0;
  at_ += time * way;
  if (time * glm::length(way) > kSamePlace * skin_) {
    let_go_of_idle_planes();
    let_go_of_slid_planes(at_, kSlidOff * skin_ + kOnPatch * surface_.size());
  }
  if (holds(plane.patch)) return;
  plane.stays = parted_here(plane.patch);
  take_plane(plane);
}

/// Finds the point nearest to the virtual tool that is one skin off the planes. In a gap narrower
/// than two skins it keeps part of the skin, or else its present distances. False if rounding hides
/// it.
bool SurfaceTool::find_goal(Vec3& goal) {
  in_crack_ = false;
  if (planes_.nearest(Vec3(0), skin_, kRounding * skin_, goal)) return true;
  in_crack_ = planes_.are_a_crack();
  for (double less = kLessSkin * skin_; less >= kExact * skin_; less *= kLessSkin) {
    if (planes_.nearest(Vec3(0), less, kRounding * less, goal)) return true;
  }
  return planes_.nearest_from(at_, skin_, kRounding * skin_, kExact * skin_, goal);
}

/// Whether the tool is at rest when the skin is removed. Adds the planes that it would enter; they
/// stay even if they hold nothing one skin away.
bool SurfaceTool::rests() {
  SurfacePlane in_the_way;
  const auto all = planes_.all();
  const bool in_valley =
      std::any_of(all.begin(), all.end(), [](const SurfacePlane& plane) { return plane.stays; });
  const double far =
      in_valley ? hidden_way(surface_.size(), skin_, glm::length(at_)) : kSamePlace * skin_;
  for (int i = 0; i < kMostInTheWay; ++i) {
    if (!in_the_way_at_rest(in_the_way)) return true;
    take_plane(in_the_way);
    if (stuck_) return false;
    const Vec3 last = exact_;
    if (!find_exact_place()) return false;
    const Vec3 moved = exact_ - last;
    if (glm::dot(moved, moved) > far * far) return false;
  }
  return false;
}

/// Moves the ideal tool as near to the virtual one as the surface allows.
void SurfaceTool::translate() {
  parted_count_ = 0;
  const double slack = kAtRest * surface_.size();
  for (int round = 0; round < kRounds && !stuck_; ++round) {
    Vec3 goal;
    if (!find_goal(goal)) break;
    const PatchHit hit = cast(at_, goal);
    if (hit.hit()) {
      move_to_hit(goal, hit);
      continue;
    }
    at_ = goal;
    let_go_of_idle_planes();
    if (!find_exact_place()) break;
    if (let_go_of_slid_planes(exact_, slack)) continue;
    if (past_a_patch_at_rest() && !find_goal(exact_)) break;  // the gap is too narrow
    if (rests()) return;
  }
  stuck_ = true;
}

namespace {

constexpr int kPushRounds = 12;          // pushes out of patches that a turn meets
constexpr double kLeastTurn = 1.0 / 16;  // of the turn; a shorter one waits for the next tick
constexpr double kFarPush = 8;           // times the turn's motion; a longer push fails
constexpr double kLonger = 1e-11;        // of the size; a sweep extends edges by it

/// m, the farthest motion of a segment end.
double most_moved(const PosedTool& from, const PosedTool& to, const Vec3& shift) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 start = to.segments[j].start + shift - from.segments[j].start;
    const Vec3 end = start + to.segments[j].along - from.segments[j].along;
    most2 = std::max({most2, glm::dot(start, start), glm::dot(end, end)});
  }
  return std::sqrt(most2);
}

/// rad, the largest turn of a segment.
double most_turned(const PosedTool& from, const PosedTool& to) {
  double most2 = 0;
  for (std::size_t j = 0; j < to.count; ++j) {
    const Vec3 turn = to.segments[j].along - from.segments[j].along;
    const double length2 = glm::dot(to.segments[j].along, to.segments[j].along);
    if (length2 > 0) most2 = std::max(most2, glm::dot(turn, turn) / length2);
  }
  return std::sqrt(most2);
}

}  // namespace

/// Finds the first patch that the tool meets while its segment ends move linearly.
PatchHit SurfaceTool::sweep(const PosedTool& from, const PosedTool& to, const Vec3& shift) const {
  PatchHit first;
  const double slack = kLonger * surface_.size();
  const auto look = [&](std::uint32_t triangle, std::size_t j, std::uint8_t what) {
    const PosedTool::Segment end{to.segments[j].start + shift, to.segments[j].along};
    sweep_triangle(surface_, triangle, static_cast<std::uint8_t>(j), what, from.segments[j], end,
                   tolerance_, slack, first);
  };
  if (room_left(from, Vec3(0)) > 0 && room_left(to, shift) > 0) {
    for (const NearTriangle& near : own_.near) look(near.triangle, near.segment, near.what);
    return first;
  }
  for (std::size_t j = 0; j < to.count; ++j) {
    const PosedTool::Segment& a = from.segments[j];
    const PosedTool::Segment b{to.segments[j].start + shift, to.segments[j].along};
    const Vec3 start = 0.5 * (a.start + b.start), along = 0.5 * (a.along + b.along);
    const Vec3 turned = 0.5 * (b.along - a.along);
    const Surface::Motion reach{0.5 * glm::length(b.start - a.start) + 2 * skin_,
                                0.5 * glm::length(b.end(true) - a.end(true)) + 2 * skin_,
                                glm::length(turned)};
    surface_.touchable(start, along, reach, [&](std::uint32_t triangle) {
      look(triangle, j, surface_pair::kAll);
      return true;
    });
  }
  return first;
}

/// Turns the ideal tool about its contacts to the virtual orientation, as far as the surface
/// allows.
/// \param most  largest fraction to try \return fraction taken, 0 to 1
double SurfaceTool::turn(const ToolPose& from, double most) {
  const PosedTool before = pose(from);
  const PosedTool whole = pose(target_);
  const Vec3 shift =
      placed_.local_vector(turned(memory_.grasp, from) - turned(memory_.grasp, target_));
  const Vec3 apart = placed_.local_vector(from.tip - target_.tip);
  planes_.clear();
  // Turn about the grasp, from the last place.
  const double motion = most_moved(before, whole, apart + shift);
  PosedTool near_whole = whole;
  for (std::size_t j = 0; j < whole.count; ++j) near_whole.segments[j].start += apart + shift;
  keep_list(before, near_whole);
  if (motion == 0) {
    pose_ = target_;
    turned_ = whole;
    at_ = apart;
    return 0;
  }
  const double far = kFarPush * motion + 4 * skin_;
  for (double fraction = most; fraction >= kLeastTurn; fraction *= 0.5) {
    ToolPose to = target_;
    if (fraction < 1) to = between(from, target_, fraction);
    to.tip = target_.tip;
    pose_ = to;
    turned_ = fraction == 1 ? whole : pose(to);
    at_ = placed_.local_vector(from.tip + turned(memory_.grasp, from) - turned(memory_.grasp, to) -
                               target_.tip);
    if (settle(before, far)) return fraction;
  }
  pose_ = from;
  pose_.tip = target_.tip;
  turned_ = before;
  for (std::size_t j = 0; j < turned_.count; ++j) turned_.segments[j].start -= apart;
  at_ = apart;
  planes_.clear();
  return 0;
}

/// Puts planes back that were raised to let a turn pass.
void SurfaceTool::lower_planes() {
  for (SurfacePlane& plane : planes_.all()) plane.depth = plane_at(plane.patch).depth;
}

/// Moves the tool to turned_ at about at_ if no patch is in the way; returns whether it did.
bool SurfaceTool::settle(const PosedTool& from, double most_push) {
  const Vec3 wanted = at_;
  double dip = skin_ + 0.125 * most_moved(from, turned_, wanted) * most_turned(from, turned_);
  planes_.clear();
  for (std::size_t i = 0; i < own_.carrying_count; ++i) {
    const SurfacePatch patch = patch_after_turn(surface_, own_.carrying[i], turned_);
    if (!holds(patch) && !planes_.full()) planes_.add(plane_at(patch));
  }
  bool raised = false;
  for (int round = 0; round < kPushRounds; ++round) {
    if (!planes_.empty()) {
      if (!planes_.nearest(wanted, skin_, skin_ / 8, at_)) return false;
      const Vec3 moved = at_ - wanted;
      if (!(glm::dot(moved, moved) <= most_push * most_push)) return false;
    }
    const PatchHit hit = sweep(from, turned_, at_);
    if (!hit.hit()) {
      if (raised) lower_planes();
      return true;
    }
    const SurfacePatch patch = patch_after_turn(surface_, hit.patch, turned_);
    bool held = false;
    for (SurfacePlane& plane : planes_.all()) {
      if (!(plane.patch == patch)) continue;
      // The tool dips below an edge on the way, although both end poses are above it.
      plane.depth += dip;
      held = raised = true;
    }
    dip *= 2;
    if (held) continue;
    if (planes_.full()) return false;
    planes_.add(plane_at(patch));
  }
  return false;
}

}  // namespace palpate::rendering
